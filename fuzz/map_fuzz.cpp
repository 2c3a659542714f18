// libFuzzer's target for image files: whatever the bytes, reading gives an image of the size that it says, or one clear
// line as InputError. Inputs whose first bytes are of no kind that is read are passed over: they go no further.
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "error.hpp"
#include "image.hpp"
#include "run_program.hpp"

namespace {

namespace fs = std::filesystem;

/// What no input may claim more of: small, so that a slow input is a bug rather than a large image.
constexpr clerestory::ReadLimits LIMITS{.max_side = 4096, .max_texels = 1U << 16, .max_bytes = 1U << 21};

/// The name that fits the first bytes; empty for a kind that is passed over.
std::string_view file_name(std::string_view bytes) {
    struct Kind {
        std::string_view magic;
        std::string_view name;
    };
    constexpr std::array<Kind, 14> KINDS = {{{{"\x76\x2f\x31\x01", 4}, "map.exr"},
                                             {{"II*\0", 4}, "map.tif"},
                                             {{"MM\0*", 4}, "map.tif"},
                                             {{"II+\0", 4}, "map.tif"},
                                             {{"MM\0+", 4}, "map.tif"},
                                             {"\x89PNG\r\n\x1a\n", "map.png"},
                                             {"\xff\xd8\xff", "map.jpg"},
                                             {"#?", "map.hdr"},
                                             {"PF\n", "map.pfm"},
                                             {"PF\r", "map.pfm"},
                                             {"PF ", "map.pfm"},
                                             {"Pf\n", "map.pfm"},
                                             {"Pf\r", "map.pfm"},
                                             {"Pf ", "map.pfm"}}};
    for (const Kind& kind : KINDS) {
        if (bytes.substr(0, kind.magic.size()) == kind.magic) return kind.name;
    }
    return {};
}

[[noreturn]] void broken(const std::string& what) {
    std::fprintf(stderr, "broken promise: %s\n", what.c_str());
    std::abort();
}

/// Runs `read`; the only exception that may come is InputError, one line that begins with the file's name.
template <class Read>
void expect_image_or_refusal(const fs::path& file, Read read) {
    try {
        read();
    } catch (const clerestory::InputError& error) {
        const std::string line = error.what();
        if (line.find('\n') != std::string::npos) broken("more than one line: " + line);
        if (line.rfind(file.string() + ": ", 0) != 0) broken("does not name the file: " + line);
    } catch (const std::exception& error) {
        broken(std::string("another exception than InputError: ") + error.what());
    }
}

}  // namespace

// libFuzzer gives the name.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-*)
    static const clerestory::test::TempFolder folder;
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    const std::string_view name = file_name(bytes);
    if (name.empty()) return -1;  // keeps it out of the corpus
    const fs::path file = folder.path() / name;
    std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(size));

    clerestory::ReadOptions options;
    options.limits = LIMITS;
    options.oiio_module = CLERESTORY_OIIO_MODULE;
    options.flip_y = size % 2 == 1;
    // Some inputs are asked for a layer or a part, by their size too.
    if (size % 5 == 1) options.layer = "combined";
    if (size % 7 == 1) options.part = 1;
    expect_image_or_refusal(file, [&] {
        const clerestory::RadianceMap map = clerestory::read_map(file, options);
        if (map.source.channels.empty()) broken("a map that nothing lit");
        if (map.width * map.height == 0 || map.rgb.size() != 3 * map.width * map.height) broken("a map of no size");
    });
    expect_image_or_refusal(file, [&] {
        const clerestory::Picture picture = clerestory::read_picture(file, options);
        const std::size_t texels = picture.width * picture.height;
        if (texels == 0 || picture.rgb.size() != 3 * texels) broken("a picture of no size");
        if (!picture.alpha.empty() && picture.alpha.size() != texels) broken("alpha of another size");
    });
    if (name == "map.exr") expect_image_or_refusal(file, [&] { clerestory::read_exr_header(file); });
    return 0;
}
