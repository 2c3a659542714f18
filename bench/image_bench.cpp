#include <algorithm>
#include <filesystem>
#include <vector>

#include <unistd.h>

#include "harness.hpp"
#include "image.hpp"
#include "scenes.hpp"

namespace clerestory::bench {
namespace {

/// A map as an uncompressed float EXR file, removed in the end.
class MapFile {
  public:
    explicit MapFile(const RadianceMap& map)
        : path_(std::filesystem::temp_directory_path() / ("clerestory_bench_" + std::to_string(getpid()) + ".exr")) {
        std::vector<float> rgba(4 * map.width * map.height, 1.0F);
        for (std::size_t texel = 0; texel < map.width * map.height; ++texel) {
            std::copy_n(map.rgb.data() + 3 * texel, 3, rgba.data() + 4 * texel);
        }
        write_exr(path_, map.width, map.height, rgba.data(), {});
    }
    MapFile(const MapFile&) = delete;
    MapFile& operator=(const MapFile&) = delete;
    ~MapFile() {
        std::error_code ignored;
        std::filesystem::remove(path_, ignored);
    }
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

  private:
    std::filesystem::path path_;
};

/// Decoding alone.
void decode(benchmark::State& state, std::size_t width) {
    const RadianceMap& map = bench_map(Light::even, width, width / 2);
    const MapFile file(map);
    const RadianceMap read = read_map(file.path(), {});
    const bool right = std::equal(read.rgb.data(), read.rgb.data() + read.rgb.size(), map.rgb.data());
    if (!check(state, right, "the map read is not the one written")) return;
    Work work;
    work.cores = all_cores();
    work.items = static_cast<double>(width * width / 2);
    work.item = "texel";
    time_runs(state, work, [&] { benchmark::DoNotOptimize(read_map(file.path(), {})); });
}
BENCHMARK_CAPTURE(decode, 4096x2048, 4096)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clerestory::bench
