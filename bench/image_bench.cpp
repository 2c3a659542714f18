#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <unistd.h>

#include <half.h>
#include <algorithm>
#include <filesystem>
#include <limits>
#include <vector>

#include "base/clock.hpp"
#include "harness.hpp"
#include "image.hpp"
#include "render/scene_loader.hpp"
#include "scenes.hpp"

namespace clerestory::bench {
namespace {

/// A map as maps are published, 16-bit RGB with ZIP compression; removed in the end.
class MapFile {
  public:
    explicit MapFile(const RadianceMap& map)
        : path_(std::filesystem::temp_directory_path() / ("clerestory_bench_" + std::to_string(getpid()) + ".exr")) {
        Imf::Header header(static_cast<int>(map.width), static_cast<int>(map.height));
        header.compression() = Imf::ZIP_COMPRESSION;
        for (const char* name : CHANNELS) header.channels().insert(name, Imf::Channel(Imf::HALF));
        Imf::OutputFile out(path_.c_str(), header, static_cast<int>(all_cores()));
        std::vector<half> band(3 * map.width * BAND_ROWS);
        for (std::size_t row = 0; row < map.height; row += BAND_ROWS) {
            const std::size_t rows = std::min(BAND_ROWS, map.height - row);
            std::copy_n(map.rgb.data() + 3 * map.width * row, 3 * map.width * rows, band.begin());
            const std::size_t stride = 3 * sizeof(half);
            Imf::FrameBuffer frame;
            for (int c = 0; c < 3; ++c) {
                frame.insert(CHANNELS[c],
                             Imf::Slice::Make(Imf::HALF, band.data() + c, {0, static_cast<int>(row)},
                                              static_cast<std::int64_t>(map.width), static_cast<std::int64_t>(rows),
                                              stride, stride * map.width));
            }
            out.setFrameBuffer(frame);
            out.writePixels(static_cast<int>(rows));
        }
    }
    MapFile(const MapFile&) = delete;
    MapFile& operator=(const MapFile&) = delete;
    ~MapFile() {
        std::error_code ignored;
        std::filesystem::remove(path_, ignored);
    }
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

  private:
    static constexpr const char* CHANNELS[3] = {"R", "G", "B"};
    static constexpr std::size_t BAND_ROWS = 256;  // whole compressed blocks
    std::filesystem::path path_;
};

bool is_rounded(const RadianceMap& read, const RadianceMap& written) {
    return std::equal(read.rgb.data(), read.rgb.data() + read.rgb.size(), written.rgb.data(),
                      [](float a, float b) { return a == static_cast<float>(half(b)); });
}

/// Decoding alone.
void decode(benchmark::State& state, std::size_t width) {
    const RadianceMap& map = bench_map(Light::even, width, width / 2);
    const MapFile file(map);
    const RadianceMap read = read_map(file.path(), {});
    if (!check(state, is_rounded(read, map), "the map read is not the one written")) return;
    Work work;
    work.cores = all_cores();
    work.items = static_cast<double>(width * width / 2);
    work.item = "texel";
    time_runs(state, work, [&] { benchmark::DoNotOptimize(read_map(file.path(), {})); });
}
BENCHMARK_CAPTURE(decode, 4096x2048, 4096)->UseRealTime()->Unit(benchmark::kMillisecond);

/// From a file to finished tables, in turns with decoding alone, which is the ceiling. The best runs count, and now one
/// goes first, now the other: both take new memory each time, and a virtual machine may hand it out at a third of the
/// speed, every other time.
void load(benchmark::State& state, std::size_t width) {
    constexpr double TARGET = 1 / 1.15;
    const MapFile file(bench_map(Light::city, width, width / 2));
    const Device& device = device_of(all_cores());
    TableBuilder builder(device);
    const auto read_alone = [&] { return read_map(file.path(), {}); };
    const auto loaded = [&] { return SceneLoader(file.path(), {}, {}).finish(device, builder); };
    {
        const Scene whole(device, builder, read_alone());
        const auto scene = loaded();
        const bool right = scene->distribution().marginal.download() == whole.distribution().marginal.download() &&
                           scene->distribution().conditional.download() == whole.distribution().conditional.download();
        if (!check(state, right, "tables differ from those of the whole map")) return;
    }
    double alone = std::numeric_limits<double>::infinity();
    double with_tables = alone;
    bool alone_first = false;
    for (auto _ : state) {
        alone_first = !alone_first;
        for (const bool tables : {!alone_first, alone_first}) {
            const Stopwatch watch;
            if (tables) {
                benchmark::DoNotOptimize(loaded());
            } else {
                benchmark::DoNotOptimize(read_alone());
            }
            double& best = tables ? with_tables : alone;
            best = std::min(best, watch.seconds());
        }
    }
    report_in_turns(state, {with_tables}, {alone}, static_cast<double>(width * width / 2), "texel", TARGET);
}
BENCHMARK_CAPTURE(load, 16384x8192, 16384)->Iterations(6)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clerestory::bench
