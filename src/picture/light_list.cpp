#include "picture/light_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "base/json_text.hpp"
#include "error.hpp"
#include "image.hpp"
#include "picture/picture_file.hpp"

namespace clerestory {
namespace {

constexpr std::size_t LONGEST_ROW = 4096;  // readers refuse images wider than some limit of theirs
constexpr const char* FORMAT = "clerestory-lights";
constexpr int FORMAT_VERSION = 1;

nlohmann::json head_of(const std::vector<DirectionalLight>& lights, const nlohmann::json& facts) {
    nlohmann::json head = facts;
    head.update({{"format", FORMAT}, {"version", FORMAT_VERSION}, {"samples", lights.size()}});
    return head;
}

float narrowed(double weight, const std::filesystem::path& file) {
    const auto value = static_cast<float>(weight);
    if (std::isfinite(value)) return value;
    throw OutputError(
        fmt::format("{}: a light's weight, {:.3g}, is too large for 32-bit floats: make the map dimmer with --scale, "
                    "or write JSON",
                    file.string(), weight));
}

}  // namespace

std::vector<DirectionalLight> light_list(const std::vector<SampleRecord>& records, double scale) {
    std::vector<DirectionalLight> lights(records.size());
    const auto count = static_cast<double>(records.size());
    for (std::size_t i = 0; i < records.size(); ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
            lights[i].direction[c] = records[i].direction[c];
            lights[i].weight[c] = scale * static_cast<double>(records[i].rgb[c]) / (count * records[i].pdf);
        }
    }
    return lights;
}

std::string lights_json(const std::vector<DirectionalLight>& lights, const nlohmann::json& facts) {
    std::string out = json_text(head_of(lights, facts), -1);
    out.pop_back();  // the closing brace comes after the lights
    out += ",\"lights\":[";
    auto to = std::back_inserter(out);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        fmt::format_to(to, "{}\n{{\"direction\":[{}],\"weight\":[{}]}}", i == 0 ? "" : ",",
                       fmt::join(lights[i].direction, ","), fmt::join(lights[i].weight, ","));
    }
    return out + "\n]}\n";
}

void write_lights_exr(const std::filesystem::path& file, const std::vector<DirectionalLight>& lights,
                      const nlohmann::json& facts) {
    const std::vector<std::string> channels = {"direction.X", "direction.Y", "direction.Z", "R", "G", "B"};
    const std::size_t width = std::min(std::max<std::size_t>(lights.size(), 1), LONGEST_ROW);
    const std::size_t height = std::max<std::size_t>((lights.size() + width - 1) / width, 1);
    std::vector<float> pixels(channels.size() * width * height, 0.0F);
    for (std::size_t i = 0; i < width * height; ++i) {
        float* pixel = pixels.data() + channels.size() * i;
        pixel[1] = 1;  // what holds no light still holds a unit direction
        if (i >= lights.size()) continue;
        for (std::size_t c = 0; c < 3; ++c) {
            pixel[c] = lights[i].direction[c];
            pixel[3 + c] = narrowed(lights[i].weight[c], file);
        }
    }
    write_exr_channels(file, width, height, channels, pixels.data(),
                       flat_header(head_of(lights, facts), nlohmann::json::object()));
}

}  // namespace clerestory
