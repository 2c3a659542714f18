#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <fmt/format.h>

#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "base/atomic_file.hpp"
#include "error.hpp"
#include "image.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// A file in memory: OpenEXR's own stream says nothing when a disk is found full at its last flush.
class MemoryStream final : public Imf::OStream {
  public:
    MemoryStream() : OStream("memory") {}
    void write(const char bytes[], int count) override {
        const auto size = static_cast<std::size_t>(count);
        if (position_ + size > bytes_.size()) bytes_.resize(position_ + size);
        std::memcpy(bytes_.data() + position_, bytes, size);
        position_ += size;
    }
    std::uint64_t tellp() override { return position_; }
    void seekp(std::uint64_t position) override { position_ = position; }
    [[nodiscard]] const std::vector<char>& bytes() const { return bytes_; }
    void reserve(std::size_t size) { bytes_.reserve(size); }

  private:
    std::vector<char> bytes_;
    std::size_t position_ = 0;
};

Imf::Header exr_header(int width, int height, const std::vector<std::string>& channels, const Header& values) {
    Imf::Header header(width, height);
    // Noisy float pixels hardly shrink: of a 511 x 511 sphere RLE saves 30 % for 4 times the time of writing it
    // plainly, ZIP 45 % for 18 times.
    header.compression() = Imf::NO_COMPRESSION;
    for (const std::string& name : channels) header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    for (const auto& [name, value] : values) {
        if (value.is_number) {
            header.insert(name, Imf::DoubleAttribute(value.number));
        } else {
            header.insert(name, Imf::StringAttribute(value.text));
        }
    }
    return header;
}

}  // namespace

void write_exr(const fs::path& file, std::size_t width, std::size_t height, const float* rgba, const Header& header) {
    write_exr_channels(file, width, height, {"R", "G", "B", "A"}, rgba, header);
}

void write_exr_channels(const fs::path& file, std::size_t width, std::size_t height,
                        const std::vector<std::string>& channels, const float* pixels, const Header& header) {
    constexpr std::size_t largest = std::numeric_limits<int>::max() / 2;
    if (width == 0 || height == 0 || width > largest || height > largest) {
        throw OutputError(fmt::format("{}: EXR cannot hold {} x {} pixels", file.string(), width, height));
    }
    MemoryStream stream;
    try {
        const std::size_t stride = channels.size() * sizeof(float);
        stream.reserve(width * height * stride);
        Imf::OutputFile out(stream, exr_header(static_cast<int>(width), static_cast<int>(height), channels, header), 0);
        Imf::FrameBuffer buffer;
        std::size_t offset = 0;
        for (const std::string& name : channels) {
            // OpenEXR takes a pointer that it could write through, and only reads.
            char* base = reinterpret_cast<char*>(const_cast<float*>(pixels + offset++));
            buffer.insert(name, Imf::Slice(Imf::FLOAT, base, stride, stride * width));
        }
        out.setFrameBuffer(buffer);
        out.writePixels(static_cast<int>(height));
    } catch (const std::exception& e) {
        throw OutputError(fmt::format("{}: EXR encoding failed: {}", file.string(), e.what()));
    }
    write_bytes(file, stream.bytes());
}

}  // namespace clerestory
