#include "shading/exact.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "error.hpp"

namespace clerestory {
namespace {

using Doubles = Buffer<cl_double>;

// As in kernels/exact.cl.
constexpr std::size_t LATITUDE_ENTRY = 12;
constexpr std::size_t MERIDIAN_ENTRY = 8;
constexpr std::size_t MERIDIANS_WIDE = 8;

// A table of this size stays in a core's own cache.
constexpr std::size_t CACHED_BYTES = std::size_t{1} << 20;
// Latitudes or meridians that a launch should add at least: its own cost is that of about one.
constexpr std::size_t FEWEST_EDGES = 8;
// Crossings of n_y and latitudes that are held at a time: 32 MiB.
constexpr std::size_t MOST_CROSSINGS = std::size_t{1} << 20;
// The horizon of a normal with n_y = 0 runs through the poles, where all meridians meet: it is tilted by this angle.
constexpr double LEAST_TILT = 1e-12;

struct CosSin {
    double cosine, sine;
};

/// Of the angle 2 pi k / n, from the nearest quarter turn: the four quarters agree to the bit.
CosSin cos_sin_of_turns(std::size_t k, std::size_t n) {
    const auto part = static_cast<std::ptrdiff_t>(4 * (k % n));
    const auto whole = static_cast<std::ptrdiff_t>(n);
    const std::ptrdiff_t quarter = (2 * part + whole) / (2 * whole);
    const double angle =
        std::numbers::pi / 2 * (static_cast<double>(part - quarter * whole) / static_cast<double>(whole));
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    switch (quarter % 4) {
        case 0:
            return {c, s};
        case 1:
            return {-s, c};
        case 2:
            return {-c, -s};
        default:
            return {s, -c};
    }
}

/// cos, sin of the angles 2 pi k / n, k = 0 .. count - 1.
std::vector<double> circle_table(std::size_t n, std::size_t count) {
    std::vector<double> table;
    table.reserve(2 * count);
    for (std::size_t k = 0; k < count; ++k) {
        const CosSin at = cos_sin_of_turns(k, n);
        table.insert(table.end(), {at.cosine, at.sine});
    }
    return table;
}

/// How many edges of `bytes` each a table holds: as many as stay in cache, but enough to be worth a launch.
std::size_t edges_of_table(const Device& device, std::size_t bytes, std::size_t all) {
    const std::size_t most = std::max<std::size_t>(ExactIntegrator::TABLE_BYTES / bytes, 1);
    if (!device.traits().fat_items) return std::min(most, all);  // work-items in lock step want as many as there are
    const std::size_t wanted = std::max(CACHED_BYTES / bytes, FEWEST_EDGES);
    return std::min({wanted, most, all});
}

/// The different n_y of a view: pixels of a picture's row share theirs, and with it how their horizon crosses
/// latitudes.
struct Rings {
    std::vector<double> y;
    std::vector<cl_uint> of_pixel;  ///< [stride]
};

double tilted(double y) {
    const double size = std::clamp(std::abs(y), LEAST_TILT, 1.0);
    return std::signbit(y) && y != 0 ? -size : size;
}

Rings rings_of(const SphereView& view) {
    std::vector<cl_float> y(view.stride);
    view.normal.download(y, view.stride);
    std::vector<cl_float> different = y;
    std::sort(different.begin(), different.end());
    different.erase(std::unique(different.begin(), different.end()), different.end());
    Rings rings;
    for (const cl_float height : different) rings.y.push_back(tilted(height));
    for (const cl_float height : y) {
        const auto found = std::lower_bound(different.begin(), different.end(), height);
        rings.of_pixel.push_back(narrow(static_cast<std::size_t>(found - different.begin())));
    }
    return rings;
}

/// Calls back with the operations done so far.
class Progress {
  public:
    Progress(double total, const std::function<void(double, double)>& report) : total_(total), report_(report) {}
    void add(double operations) {
        done_ += operations;
        if (report_) report_(std::min(done_, total_), total_);
    }

  private:
    double done_ = 0;
    double total_;
    const std::function<void(double, double)>& report_;
};

const Device& with_doubles(const Device& device) {
    if (!device.traits().fp64) {
        throw DeviceError(
            fmt::format("device {} has no double precision, which the exact estimator needs: choose another with "
                        "--device (see `clerestory devices`), or another estimator",
                        device.info().name));
    }
    return device;
}

}  // namespace

struct ExactIntegrator::State {
    explicit State(const Device& opened) : device(with_doubles(opened)) {}

    const Device& device;
    Program program{device, "exact.cl"};
    Kernel<Floats, Uints, Doubles, cl_uint, cl_double, cl_double, Doubles, cl_uint, Doubles> frame_pixels{
        device, program, "frame_pixels"};
    Kernel<Doubles, cl_uint, Doubles, cl_uint, cl_uint, cl_uint, Doubles> cross_latitudes{device, program,
                                                                                          "cross_latitudes"};
    bool fat = device.traits().fat_items;
    Kernel<Floats, cl_uint, cl_uint, cl_double, Doubles, cl_uint, cl_uint, Doubles> sum_latitudes{
        device, program, fat ? "sum_latitudes" : "sum_latitude_numbers"};
    Kernel<Doubles, Uints, Doubles, cl_uint, Doubles, Doubles, Doubles, cl_uint, Doubles, cl_uint, cl_uint, Doubles>
        add_latitudes{device, program, "add_latitudes"};
    Kernel<Floats, cl_uint, cl_uint, cl_double, cl_uint, cl_uint, Doubles> sum_meridians{
        device, program, fat ? "sum_meridians" : "sum_meridian_numbers"};
    Kernel<Doubles, Uints, Doubles, cl_uint, Doubles, Doubles, cl_uint, Doubles, cl_uint, cl_uint, Doubles>
        add_meridians{device, program, "add_meridians"};
    Kernel<Doubles, cl_uint, Floats> finish_white{device, program, "finish_white"};

    /// A view's pixels as the kernels take them, and what has been summed for them.
    struct Pixels {
        std::size_t stride = 0;
        std::size_t rings = 0;
        Doubles ring_y;
        Uints ring;
        Doubles frames;
        Doubles sums;
    };
    struct Grid {
        const DeviceMap& map;
        double scale;
        Doubles latitudes;
        Doubles meridians;
    };

    Range pixel_range(const Pixels& pixels) const { return device.thin(pixels.stride); }

    /// Of the sums along `count` edges, whose entries have so many numbers.
    Range edge_range(std::size_t count, std::size_t numbers) const {
        return fat ? device.fat(count) : device.thin(numbers * count);
    }

    Pixels pixels_of(const SphereView& view, double rotate_y_deg, const Grid& grid) {
        const Rings rings = rings_of(view);
        Pixels pixels{view.stride,
                      rings.y.size(),
                      {device, "the heights of the normals", std::span<const cl_double>(rings.y)},
                      {device, "the pixels' heights", std::span<const cl_uint>(rings.of_pixel)},
                      {device, "the pixels' frames", 4 * view.stride},
                      {device, "the pixels' sums", 3 * view.stride}};
        pixels.sums.fill(0.0);
        const double turn = std::remainder(rotate_y_deg, 360.0) * std::numbers::pi / 180;
        frame_pixels(pixel_range(pixels), view.normal, pixels.ring, pixels.ring_y, narrow(view.stride), std::cos(turn),
                     std::sin(turn), grid.meridians, narrow(grid.map.width), pixels.frames);
        return pixels;
    }

    void add_all_latitudes(const Grid& grid, Pixels& pixels, Progress& progress) {
        const std::size_t edges = grid.map.height + 1;
        const cl_uint width = narrow(grid.map.width);
        const std::size_t entries = LATITUDE_ENTRY * (grid.map.width + 1);
        const std::size_t band = std::min(edges_of_table(device, entries * sizeof(cl_double), edges),
                                          std::max<std::size_t>(MOST_CROSSINGS / pixels.rings, 1));
        Doubles moments(device, "sums along latitudes", entries * band);
        Doubles crossings(device, "crossings of latitudes", 4 * pixels.rings * band);
        for (std::size_t first = 0; first < edges; first += band) {
            const std::size_t count = std::min(band, edges - first);
            sum_latitudes(edge_range(count, LATITUDE_ENTRY), grid.map.radiance, width, narrow(grid.map.height),
                          grid.scale, grid.meridians, narrow(first), narrow(count), moments);
            cross_latitudes(device.thin(pixels.rings * count), pixels.ring_y, narrow(pixels.rings), grid.latitudes,
                            narrow(first), narrow(count), width, crossings);
            add_latitudes(pixel_range(pixels), pixels.frames, pixels.ring, pixels.ring_y, narrow(pixels.stride),
                          crossings, grid.latitudes, grid.meridians, width, moments, narrow(first), narrow(count),
                          pixels.sums);
            device.finish();
            progress.add(estimated_operations(pixels.stride, 0, count - 1));
        }
    }

    void add_all_meridians(const Grid& grid, Pixels& pixels, Progress& progress) {
        // One column has no edge: both sides of its only meridian are the same texel.
        if (grid.map.width == 1) return;
        const std::size_t edges = grid.map.width;
        const cl_uint height = narrow(grid.map.height);
        const std::size_t entries = MERIDIAN_ENTRY * (grid.map.height + 1);
        const std::size_t fitting = edges_of_table(device, entries * sizeof(cl_double), edges);
        const std::size_t band = std::max(fitting / MERIDIANS_WIDE * MERIDIANS_WIDE, std::min(fitting, MERIDIANS_WIDE));
        Doubles moments(device, "sums along meridians", entries * band);
        for (std::size_t first = 0; first < edges; first += band) {
            const std::size_t count = std::min(band, edges - first);
            sum_meridians(edge_range(count, MERIDIAN_ENTRY), grid.map.radiance, narrow(grid.map.width), height,
                          grid.scale, narrow(first), narrow(count), moments);
            add_meridians(pixel_range(pixels), pixels.frames, pixels.ring, pixels.ring_y, narrow(pixels.stride),
                          grid.latitudes, grid.meridians, height, moments, narrow(first), narrow(count), pixels.sums);
            device.finish();
            progress.add(static_cast<double>(pixels.stride) * static_cast<double>(count));
        }
    }
};

ExactIntegrator::ExactIntegrator(const Device& device) : state_(std::make_unique<State>(device)) {}
ExactIntegrator::ExactIntegrator(ExactIntegrator&&) noexcept = default;
ExactIntegrator& ExactIntegrator::operator=(ExactIntegrator&&) noexcept = default;
ExactIntegrator::~ExactIntegrator() = default;

double ExactIntegrator::estimated_operations(std::size_t pixels, std::size_t width, std::size_t height) {
    return static_cast<double>(pixels) * (2 * (static_cast<double>(height) + 1) + static_cast<double>(width));
}

void ExactIntegrator::shade(const DeviceMap& map, const Distribution& distribution, double rotate_y_deg,
                            const SphereView& view, Floats& unit_albedo_radiance,
                            const std::function<void(double, double)>& progress) {
    if (distribution.black()) {
        unit_albedo_radiance.fill(0.0F);
        state_->device.finish();
        return;
    }
    State& s = *state_;
    const std::vector<double> latitudes = circle_table(2 * map.height, map.height + 1);
    const std::vector<double> meridians = circle_table(map.width, map.width + MERIDIANS_WIDE);
    const State::Grid grid{map,
                           std::ldexp(1.0, -distribution.exponent),
                           {s.device, "latitudes", std::span<const cl_double>(latitudes)},
                           {s.device, "meridians", std::span<const cl_double>(meridians)}};
    State::Pixels pixels = s.pixels_of(view, rotate_y_deg, grid);
    Progress told(estimated_operations(pixels.stride, map.width, map.height), progress);
    s.add_all_latitudes(grid, pixels, told);
    s.add_all_meridians(grid, pixels, told);
    s.finish_white(s.device.thin(3 * view.stride), pixels.sums, narrow(3 * view.stride), unit_albedo_radiance);
    s.device.finish();
}

}  // namespace clerestory
