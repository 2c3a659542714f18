#include "shading/harmonic.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "map/latlong.hpp"
#include "shading/legendre.hpp"
#include "shading/stage4_shade.hpp"

namespace clerestory {
namespace {

using std::numbers::pi;
constexpr std::size_t CHANNELS = 3;

constexpr std::size_t HARMONIC_REGISTERS = 2;
constexpr std::size_t ROWS_PER_ITEM = 4;
// More of them share the steps of the recurrence; in lock step they must fit into a work-item's own registers.
constexpr std::size_t LIGHT_REGISTERS = 16;
constexpr std::size_t LIGHT_REGISTERS_IN_STEP = 4;
// Histograms for each compute unit: more share the rows out evenly, fewer are joined sooner.
constexpr std::size_t HISTOGRAMS_PER_UNIT = 4;
// Texels that a work-item in lock step counts: enough to be worth starting it.
constexpr std::size_t TEXELS_PER_ITEM = 16;
// Largest side of a light, radians: a texel of a map 512 wide. A light counts as a point, which is wrong only for
// normals to which it lies on the horizon; alone in a black sky, one of this size costs 3e-4 of relative RMSE.
constexpr double LIGHT_SIDE = 2 * pi / 512;

float map_scale(int exponent) { return std::ldexp(1.0F, -exponent); }

/// Integral of w over the cell about (theta, phi) of the given sides; products, where differences would cancel.
std::array<double, 3> cell_integral(double theta, double phi, double theta_side, double phi_side) {
    const double across = theta_side / 2 - std::cos(2 * theta) * std::sin(theta_side) / 2;  // of sin^2(theta)
    const double wide = 2 * std::sin(phi_side / 2);
    return {across * wide * std::cos(phi), std::sin(2 * theta) * std::sin(theta_side) / 2 * phi_side,
            across * wide * std::sin(phi)};
}

/// Pieces that a side of a texel is cut into, so that none is longer than LIGHT_SIDE.
std::size_t pieces(double side) { return static_cast<std::size_t>(std::max(1.0, std::ceil(side / LIGHT_SIDE - 1e-9))); }

/// How a map's texels become lights.
struct Pieces {
    explicit Pieces(const DeviceMap& map)
        : down(pieces(pi / static_cast<double>(map.height))), along(pieces(2 * pi / static_cast<double>(map.width))) {}
    std::size_t down;
    std::size_t along;
    [[nodiscard]] std::size_t count() const noexcept { return down * along; }
};

/// The least intensity, of those where bins meet, above which there are at most `most` texels.
///   bins  [sets * INTENSITY_BINS]
float light_threshold(const std::vector<cl_uint>& bins, std::size_t most) {
    if (most == 0) return std::numeric_limits<float>::infinity();
    std::size_t above = 0;
    for (std::size_t bin = INTENSITY_BINS; bin-- > 0;) {
        for (std::size_t set = 0; set < bins.size(); set += INTENSITY_BINS) above += bins[set + bin];
        if (above > most) return std::bit_cast<float>(static_cast<std::uint32_t>(bin + 1) << INTENSITY_SHIFT);
    }
    return 0;
}

/// cos(m phi) and sin(m phi) at the columns' centres, as sum_rows reads them, or as sum_rows_in_step does.
std::vector<float> column_waves(std::size_t width, std::size_t stride, std::size_t degree, bool in_step) {
    std::vector<float> waves(2 * (degree + 1) * stride, 0.0F);
    for (std::size_t m = 0; m <= degree; ++m) {
        const auto place = [&](std::size_t j, std::size_t wave) {
            return in_step ? (2 * j + wave) * (degree + 1) + m : (2 * m + wave) * stride + j;
        };
        for (std::size_t j = 0; j < width; ++j) {
            // m (2 j + 1) half columns, reduced to one turn exactly.
            const auto turns = static_cast<double>(m * (2 * j + 1) % (2 * width)) / static_cast<double>(2 * width);
            waves[place(j, 0)] = static_cast<float>(std::cos(2 * pi * turns));
            waves[place(j, 1)] = static_cast<float>(std::sin(2 * pi * turns));
        }
    }
    return waves;
}

/// Integral of cos(m phi) over a column over its value at the centre.
double column_integral(std::size_t m, std::size_t width) {
    const double side = 2 * pi / static_cast<double>(width);
    return m == 0 ? side : 2 * std::sin(static_cast<double>(m) * side / 2) / static_cast<double>(m);
}

/// Relative RMSE that the cut leaves, see ProjectedMap; `energy` is the integral of the squared radiance, channels
/// added up, of all that the series was made of.
void judge_truncation(ProjectedMap& light, double energy) {
    double mean = light.coefficients[0][0] + light.coefficients[0][1] + light.coefficients[0][2];
    mean /= std::sqrt(4 * pi);
    for (const AreaTexel& direct : light.lights) {
        const auto& v = direct.vector;
        const double flux = static_cast<double>(direct.radiance[0]) + static_cast<double>(direct.radiance[1]) +
                            static_cast<double>(direct.radiance[2]);
        mean += flux * std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) / (4 * pi);
    }
    if (mean == 0) return;
    std::vector<double> spectrum(light.degree + 1, 0.0);
    for (std::size_t l = 0; l <= light.degree; ++l) {
        for (std::size_t m = 0; m <= l; ++m) {
            for (const double c : light.coefficients[triangle_index(l, m)]) spectrum[l] += c * c;
        }
        energy -= spectrum[l];
    }
    energy = std::max(energy, 0.0);
    const std::size_t last = light.degree - light.degree % 2;
    const std::size_t next = light.degree == 0 ? 1 : last + 2;
    const std::size_t horizon = 16 * (last + 2);  // the sum falls with the cube of the degree
    const std::vector<double> factors = lambert_factors(horizon);
    const auto rms = [&](double sum) { return std::sqrt(sum * CHANNELS / (4 * pi)) / mean; };
    light.truncation_bound = rms(energy * factors[next] * factors[next]);
    const std::size_t earlier = last < 4 ? last : last - 2;
    const double coefficients = static_cast<double>(2 * last + 1 + (earlier == last ? 0 : 2 * earlier + 1));
    const double each = (spectrum[last] + (earlier == last ? 0 : spectrum[earlier])) / coefficients;
    double beyond = 0;
    for (std::size_t l = next; l <= horizon; ++l) {
        beyond += static_cast<double>(2 * l + 1) * factors[l] * factors[l] * each;
    }
    light.truncation_estimate = std::min(rms(beyond), light.truncation_bound);
}

/// The coefficients of a map that is turned by `rotation`.
HarmonicCoefficients turned(const HarmonicCoefficients& coefficients, std::size_t degree, double rotation) {
    HarmonicCoefficients to(coefficients.size());
    for (std::size_t m = 0; m <= degree; ++m) {
        const double c = std::cos(static_cast<double>(m) * rotation);
        const double s = std::sin(static_cast<double>(m) * rotation);
        for (std::size_t l = m; l <= degree; ++l) {
            const std::size_t at = triangle_index(l, m);
            for (std::size_t k = 0; k < CHANNELS; ++k) {
                to[at][k] = c * coefficients[at][k] - s * coefficients[at][CHANNELS + k];
                to[at][CHANNELS + k] = s * coefficients[at][k] + c * coefficients[at][CHANNELS + k];
            }
        }
    }
    return to;
}

// sqrt(3 / (4 pi)), what the harmonics of degree 1 are of x, y and z.
const double FIRST_DEGREE = std::sqrt(3 / (4 * pi));

/// Calls step(l, m, at) for every step of what evaluate_harmonics reads, `at` its place in there; returns the size.
template <class Step>
std::size_t walk_terms(std::size_t degree, const Step& step) {
    std::size_t at = 3 * CHANNELS;
    for (std::size_t m = 0; m <= degree; ++m) {
        ++at;
        for (std::size_t l = m + m % 2; l <= degree; l += 2, at += 9) step(l, m, at);
    }
    return at;
}

/// What evaluate_harmonics reads: a series, lit by the clamped cosine.
std::vector<float> series_terms(const HarmonicCoefficients& series, std::size_t degree) {
    const std::vector<double> factors = lambert_factors(degree);
    std::vector<float> terms;
    const auto add = [&](double value) { terms.push_back(static_cast<float>(value)); };
    const auto along = degree == 0 ? std::array<double, 6>{} : series[triangle_index(1, 0)];
    const auto across = degree == 0 ? std::array<double, 6>{} : series[triangle_index(1, 1)];
    for (std::size_t k = 0; k < CHANNELS; ++k) {
        for (const double c : {across[k], along[k], across[CHANNELS + k]}) {
            add(degree == 0 ? 0 : factors[1] * FIRST_DEGREE * c);
        }
    }
    const auto alpha_square = [](double l, double m) { return l <= m ? 0 : (l * l - m * m) / (4 * l * l - 1); };
    double first = 1 / std::sqrt(4 * pi);  // P_mm / sin(theta)^m
    for (std::size_t m = 0; m <= degree; ++m) {
        const auto order = static_cast<double>(m);
        if (m > 0) first *= std::sqrt(1 + 1 / (2 * order));
        add(m % 2 == 0 ? first : first * std::sqrt(2 * order + 3));
        for (std::size_t l = m + m % 2; l <= degree; l += 2) {
            const auto d = static_cast<double>(l);
            const double up = std::sqrt(alpha_square(d + 1, order) * alpha_square(d + 2, order));
            add(1 / up);
            add(-(alpha_square(d + 1, order) + alpha_square(d, order)) / up);
            add(-std::sqrt(alpha_square(d, order) * alpha_square(d - 1, order)) / up);
            for (const double c : series[triangle_index(l, m)])
                add(factors[l] * (m == 0 ? 1 : std::numbers::sqrt2) * c);
        }
    }
    return terms;
}

/// Direct lights as a shader takes them.
LightBuffer lights_of(const Device& device, const ProjectedMap& light, double rotation) {
    const double c = std::cos(rotation);
    const double s = std::sin(rotation);
    LightBuffer lights(device, light.lights.size());
    std::vector<float> planes(lights.planes.size(), 0.0F);
    for (std::size_t i = 0; i < light.lights.size(); ++i) {
        const auto& [v, radiance] = light.lights[i];
        const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        const auto plane = [&](std::size_t p) -> float& { return planes[p * lights.stride + i]; };
        plane(0) = static_cast<float>((v[0] * c - v[2] * s) / length);
        plane(1) = static_cast<float>(v[1] / length);
        plane(2) = static_cast<float>((v[0] * s + v[2] * c) / length);
        for (std::size_t k = 0; k < CHANNELS; ++k) {
            plane(3 + k) = static_cast<float>(length / pi * static_cast<double>(radiance[k]));
        }
    }
    lights.planes.upload(planes);
    return lights;
}

std::size_t light_registers(const DeviceTraits& traits) {
    return traits.fat_items ? LIGHT_REGISTERS : LIGHT_REGISTERS_IN_STEP;
}

std::string defines(const DeviceTraits& traits) {
    return fmt::format("-DPIXELS_WIDE={} -DHARMONIC_REGISTERS={} -DROWS_PER_ITEM={} -DLIGHT_REGISTERS={}",
                       traits.simd_width, HARMONIC_REGISTERS, ROWS_PER_ITEM, light_registers(traits));
}

}  // namespace

// Parts of HarmonicShader::State, which no unnamed namespace may hold where several files are compiled as one.

/// Kernels that read the map where work-items are fat, each a row or more of them.
struct FatProjection {
    FatProjection(const Device& device, const Program& program)
        : count_intensities(device, program, "count_intensities"),
          count_lights(device, program, "count_lights"),
          collect_lights(device, program, "collect_lights"),
          sum_rows(device, program, "sum_rows") {}

    Kernel<Floats, cl_uint, cl_uint, cl_uint, cl_float, Uints> count_intensities;
    Kernel<Floats, cl_uint, cl_uint, cl_float, cl_float, Uints> count_lights;
    Kernel<Floats, cl_uint, cl_uint, cl_float, cl_float, Uints, Uints, Uints, Floats> collect_lights;
    Kernel<Floats, cl_uint, cl_uint, cl_float, cl_float, Floats, cl_uint, cl_uint, Floats, Floats> sum_rows;
};

/// The same where they run in lock step.
struct StepProjection {
    StepProjection(const Device& device, const Program& program)
        : count_intensities(device, program, "count_intensities_in_step"),
          collect_lights(device, program, "collect_lights_in_step"),
          sum_rows(device, program, "sum_rows_in_step") {}

    Kernel<Floats, cl_uint, cl_uint, cl_float, cl_uint, Uints> count_intensities;
    Kernel<Floats, cl_uint, cl_float, cl_float, cl_uint, Uints, Uints, Floats> collect_lights;
    Kernel<Floats, cl_uint, cl_uint, cl_float, cl_float, Floats, cl_uint, Floats, Floats> sum_rows;
};

namespace {

/// Texels that exceed the lights' threshold, in the map's order, and by how much.
struct Excess {
    std::vector<cl_uint> texel;
    std::vector<float> radiance;  ///< [3 * texels]
};

/// Puts what was collected in no order into the map's.
Excess sorted(const std::vector<cl_uint>& texel, const std::vector<float>& radiance) {
    std::vector<std::size_t> order(texel.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return texel[a] < texel[b]; });
    Excess excess;
    for (const std::size_t at : order) {
        excess.texel.push_back(texel[at]);
        for (std::size_t k = 0; k < CHANNELS; ++k) excess.radiance.push_back(radiance[CHANNELS * at + k]);
    }
    return excess;
}

}  // namespace

struct HarmonicShader::State {
    explicit State(const Device& opened) : device(opened) {
        if (device.traits().fat_items) {
            fat.emplace(device, program);
        } else {
            in_step.emplace(device, program);
        }
    }

    const Device& device;
    Program program{device, "harmonic.cl", defines(device.traits())};
    std::optional<FatProjection> fat;  ///< one of the two
    std::optional<StepProjection> in_step;
    Kernel<Floats, Floats, cl_uint, cl_uint, cl_uint, cl_uint, cl_uint, Floats> evaluate_harmonics{
        device, program, "evaluate_harmonics"};

    Kernel<Floats, cl_uint, Floats, cl_uint, cl_uint, cl_uint, Floats> project_lights{device, program,
                                                                                      "project_lights"};
    std::optional<LightShader> direct;  ///< built when first needed: a control variate has no direct lights

    /// What depends on a map's size and the degree alone, kept from one map to the next.
    struct Tables {
        std::size_t width = 0;
        std::size_t height = 0;
        std::size_t degree = 0;
        std::size_t stride = 0;
        Floats waves;
        std::vector<double> rows;  ///< legendre_row_integrals
    } tables;

    const Tables& tables_for(const DeviceMap& map, std::size_t degree) {
        if (tables.width == map.width && tables.height == map.height && tables.degree == degree) return tables;
        const std::size_t stride = (map.width + WIDEST_SIMD - 1) / WIDEST_SIMD * WIDEST_SIMD;
        const std::vector<float> waves = column_waves(map.width, stride, degree, in_step.has_value());
        tables = {map.width,
                  map.height,
                  degree,
                  stride,
                  Floats(device, "the columns' waves", std::span<const float>(waves)),
                  legendre_row_integrals(map.height, degree)};
        return tables;
    }

    /// [sets * INTENSITY_BINS]
    std::vector<cl_uint> intensity_bins(const DeviceMap& map, float scale) {
        const std::size_t units = HISTOGRAMS_PER_UNIT * device.info().compute_units;
        if (fat) {
            const std::size_t share = (map.height - 1) / units + 1;
            const std::size_t sets = (map.height - 1) / share + 1;
            Uints bins(device, "the intensities' histograms", sets * INTENSITY_BINS);
            fat->count_intensities({sets, 1}, map.radiance, narrow(map.width), narrow(map.height), narrow(share), scale,
                                   bins);
            return bins.download();
        }
        const std::size_t texels = map.width * map.height;
        const std::size_t items = (texels - 1) / TEXELS_PER_ITEM + 1;
        Uints bins(device, "the intensities' histograms", units * INTENSITY_BINS);
        bins.fill(0);
        in_step->count_intensities(device.thin(items), map.radiance, narrow(texels), narrow(items), scale,
                                   narrow(units), bins);
        return bins.download();
    }

    Excess collect_by_rows(const DeviceMap& map, float scale, float threshold) {
        const auto w = narrow(map.width);
        const auto h = narrow(map.height);
        Uints count(device, "the rows' lights", map.height);
        fat->count_lights(device.fat(map.height), map.radiance, w, h, scale, threshold, count);
        std::vector<cl_uint> first = count.download();
        cl_uint total = 0;
        for (cl_uint& f : first) f = std::exchange(total, total + f);
        if (total == 0) return {};
        const Uints starts(device, "the rows' first lights", std::span<const cl_uint>(first));
        Uints texel(device, "the lights' texels", total);
        Floats excess(device, "the lights' radiances", CHANNELS * total);
        // A texel within rounding of the threshold may be counted and then give nothing.
        texel.fill(0);
        excess.fill(0.0F);
        fat->collect_lights(device.fat(map.height), map.radiance, w, h, scale, threshold, starts, count, texel, excess);
        return {texel.download(), excess.download()};
    }

    Excess collect_in_step(const DeviceMap& map, float scale, float threshold, std::size_t most) {
        const std::size_t texels = map.width * map.height;
        Uints found(device, "the number of lights", 1);
        Uints texel(device, "the lights' texels", most);
        Floats excess(device, "the lights' radiances", CHANNELS * most);
        found.fill(0);
        in_step->collect_lights(device.thin(texels), map.radiance, narrow(texels), scale, threshold, narrow(most),
                                found, texel, excess);
        const std::size_t count = std::min<std::size_t>(found.download()[0], most);
        std::vector<cl_uint> texels_found(count);
        std::vector<float> excess_found(CHANNELS * count);
        texel.download(texels_found);
        excess.download(excess_found);
        return sorted(texels_found, excess_found);
    }

    /// Takes what exceeds the threshold as lights; returns the threshold.
    float take_lights(const DeviceMap& map, std::size_t most, ProjectedMap& light) {
        const Pieces cut(map);
        const float scale = map_scale(light.exponent);
        const std::size_t texels = most / cut.count();
        if (texels == 0) return std::numeric_limits<float>::infinity();
        const float threshold = light_threshold(intensity_bins(map, scale), texels);
        const Excess excess =
            fat ? collect_by_rows(map, scale, threshold) : collect_in_step(map, scale, threshold, texels);
        add_lights(map, cut, excess.texel, excess.radiance, light);
        return threshold;
    }

    static void add_lights(const DeviceMap& map, const Pieces& cut, const std::vector<cl_uint>& texel,
                           const std::vector<float>& excess, ProjectedMap& light) {
        const double theta_side = pi / static_cast<double>(map.height * cut.down);
        const double phi_side = 2 * pi / static_cast<double>(map.width * cut.along);
        light.light_texels = texel.size();
        light.lights.reserve(texel.size() * cut.count());
        for (std::size_t t = 0; t < texel.size(); ++t) {
            const std::size_t row = texel[t] / map.width;
            const std::size_t column = texel[t] % map.width;
            for (std::size_t p = 0; p < cut.count(); ++p) {
                const std::size_t cell_row = row * cut.down + p / cut.along;
                const std::size_t cell_column = column * cut.along + p % cut.along;
                const double down = static_cast<double>(cell_row) + 0.5;
                const double along = static_cast<double>(cell_column) + 0.5;
                light.lights.push_back({cell_integral(down * theta_side, along * phi_side, theta_side, phi_side),
                                        {excess[3 * t], excess[3 * t + 1], excess[3 * t + 2]}});
            }
        }
    }

    /// Projects what the threshold leaves; returns the integral of its squared radiance.
    double add_series(const DeviceMap& map, float threshold, ProjectedMap& light) {
        const std::size_t degree = light.degree;
        const std::size_t size = triangle_size(degree);
        const Tables& t = tables_for(map, degree);
        Floats sums(device, "the rows' Fourier sums", map.height * (degree + 1) * 2 * CHANNELS);
        Floats squares(device, "the rows' squares", map.height * CHANNELS);
        const float scale = map_scale(light.exponent);
        const auto w = narrow(map.width);
        const auto h = narrow(map.height);
        if (fat) {
            const std::size_t items = (map.height + ROWS_PER_ITEM - 1) / ROWS_PER_ITEM;
            fat->sum_rows({items, 1}, map.radiance, w, h, scale, threshold, t.waves, narrow(t.stride), narrow(degree),
                          sums, squares);
        } else {
            in_step->sum_rows(device.thin(map.height * (degree + 1)), map.radiance, w, h, scale, threshold, t.waves,
                              narrow(degree), sums, squares);
        }
        const std::vector<float> fourier = sums.download();
        const std::vector<float> square = squares.download();
        const std::vector<double> solid_angle = texel_solid_angles(map.width, map.height);

        light.coefficients.assign(size, {});
        double energy = 0;
        for (std::size_t i = 0; i < map.height; ++i) {
            for (std::size_t k = 0; k < CHANNELS; ++k) {
                energy += solid_angle[i] * static_cast<double>(square[CHANNELS * i + k]);
            }
            for (std::size_t m = 0; m <= degree; ++m) {
                const float* const from = fourier.data() + 2 * CHANNELS * (i * (degree + 1) + m);
                for (std::size_t l = m; l <= degree; ++l) {
                    if (l % 2 == 1 && l != 1) continue;
                    auto& to = light.coefficients[triangle_index(l, m)];
                    const double p = t.rows[i * size + triangle_index(l, m)];
                    for (std::size_t k = 0; k < 2 * CHANNELS; ++k) to[k] += p * static_cast<double>(from[k]);
                }
            }
        }
        for (std::size_t m = 0; m <= degree; ++m) {
            const double gain = column_integral(m, map.width) * (m == 0 ? 1 : std::numbers::sqrt2);
            for (std::size_t l = m; l <= degree; ++l) {
                for (double& c : light.coefficients[triangle_index(l, m)]) c *= gain;
            }
        }
        return energy;
    }

    void evaluate(const HarmonicCoefficients& series, std::size_t degree, const SphereView& view, bool add,
                  bool clamped, Floats& unit_albedo_radiance) {
        const std::vector<float> values = series_terms(series, degree);
        const Floats terms(device, "the harmonic series", std::span<const float>(values));
        const std::size_t items = view.stride / (device.traits().simd_width * HARMONIC_REGISTERS);
        evaluate_harmonics(device.some(items), view.normal, terms, narrow(degree), narrow(view.stride), narrow(items),
                           add ? 1U : 0U, clamped ? 1U : 0U, unit_albedo_radiance);
        device.finish();
    }

    /// Sums of project_lights over all of its work-items.
    std::vector<double> sums_over(const LightBuffer& lights, std::size_t degree) {
        const std::vector<float> steps = series_terms(HarmonicCoefficients(triangle_size(degree)), degree);
        const Floats terms(device, "the harmonics' steps", std::span<const float>(steps));
        const std::size_t each = device.traits().simd_width * light_registers(device.traits());
        const std::size_t items = (lights.stride + each - 1) / each;
        Floats sums(device, "the lights' harmonics", items * steps.size());
        project_lights(device.fat(items), lights.planes, narrow(lights.stride), terms, narrow(degree), narrow(items),
                       narrow(steps.size()), sums);
        const std::vector<float> found = sums.download();
        std::vector<double> total(steps.size(), 0);
        for (std::size_t i = 0; i < found.size(); ++i) {
            total[fat ? i % steps.size() : i / items] += static_cast<double>(found[i]);  // see SUM_PLACE
        }
        return total;
    }
};

HarmonicShader::HarmonicShader(const Device& device) : state_(std::make_unique<State>(device)) {}
HarmonicShader::HarmonicShader(HarmonicShader&&) noexcept = default;
HarmonicShader& HarmonicShader::operator=(HarmonicShader&&) noexcept = default;
HarmonicShader::~HarmonicShader() = default;

ProjectedMap HarmonicShader::project(const DeviceMap& map, const Distribution& distribution,
                                     const HarmonicOptions& options) {
    if (options.degree > HarmonicOptions::MAX_DEGREE) {
        throw UsageError(fmt::format("harmonic degree {}: at most {}", options.degree, HarmonicOptions::MAX_DEGREE));
    }
    if (options.lights > HarmonicOptions::MAX_LIGHTS) {
        throw UsageError(fmt::format("{} direct lights: at most {}", options.lights, HarmonicOptions::MAX_LIGHTS));
    }
    ProjectedMap light;
    light.degree = options.degree;
    light.exponent = distribution.exponent;
    const float threshold = state_->take_lights(map, options.lights, light);
    judge_truncation(light, state_->add_series(map, threshold, light));
    return light;
}

void HarmonicShader::shade(const ProjectedMap& light, double rotate_y_deg, const SphereView& view,
                           Floats& unit_albedo_radiance) {
    State& s = *state_;
    const double rotation = rotate_y_deg * pi / 180;
    if (!light.lights.empty()) {
        if (!s.direct) s.direct.emplace(s.device);
        s.direct->shade(view, lights_of(s.device, light, rotation), false, unit_albedo_radiance);
    }
    s.evaluate(turned(light.coefficients, light.degree, rotation), light.degree, view, !light.lights.empty(), true,
               unit_albedo_radiance);
}

void HarmonicShader::shade_series(const ProjectedMap& light, double rotate_y_deg, const SphereView& view,
                                  Floats& unit_albedo_radiance) {
    state_->evaluate(turned(light.coefficients, light.degree, rotate_y_deg * pi / 180), light.degree, view, false,
                     false, unit_albedo_radiance);
}

void HarmonicShader::project(const LightBuffer& lights, std::size_t degree, HarmonicCoefficients& coefficients) {
    coefficients.resize(triangle_size(degree));
    const std::vector<double> sums = state_->sums_over(lights, degree);
    // A weight is 1 / pi of the radiance over density that a coefficient counts.
    for (std::size_t k = 0; degree > 0 && k < CHANNELS; ++k) {
        const double gain = pi * FIRST_DEGREE;
        coefficients[triangle_index(1, 1)][k] += gain * sums[3 * k];
        coefficients[triangle_index(1, 0)][k] += gain * sums[3 * k + 1];
        coefficients[triangle_index(1, 1)][CHANNELS + k] += gain * sums[3 * k + 2];
    }
    walk_terms(degree, [&](std::size_t l, std::size_t m, std::size_t at) {
        const double gain = pi * (m == 0 ? 1 : std::numbers::sqrt2);
        for (std::size_t k = 0; k < 2 * CHANNELS; ++k) coefficients[triangle_index(l, m)][k] += gain * sums[at + 3 + k];
    });
}

void HarmonicShader::add_difference(const ProjectedMap& light, double rotate_y_deg, const HarmonicCoefficients& taken,
                                    const SphereView& view, Floats& unit_albedo_radiance) {
    HarmonicCoefficients left = turned(light.coefficients, light.degree, rotate_y_deg * pi / 180);
    for (std::size_t i = 0; i < left.size(); ++i) {
        for (std::size_t k = 0; k < 2 * CHANNELS; ++k) left[i][k] -= taken[i][k];
    }
    state_->evaluate(left, light.degree, view, true, false, unit_albedo_radiance);
}

void check_control_degree(unsigned degree) {
    if (degree > SamplingOptions::MAX_CONTROL_DEGREE) {
        throw UsageError(fmt::format("control degree {}: at most {}", degree, SamplingOptions::MAX_CONTROL_DEGREE));
    }
}

void ControlVariate::check(const SamplingOptions& options) const {
    check_control_degree(options.control_degree);
    const std::size_t degree = map != nullptr ? map->degree : 0;
    if (degree != options.control_degree) {
        throw UsageError(fmt::format("a control variate of degree {} where samples are drawn for one of degree {}",
                                     degree, options.control_degree));
    }
}

}  // namespace clerestory
