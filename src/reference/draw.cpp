#include "reference/draw.hpp"

#include <cmath>
#include <numbers>

namespace clerestory::reference {
namespace {

constexpr long double PI = std::numbers::pi_v<long double>;

long double edge(std::size_t row, std::size_t height) {
    return PI * static_cast<long double>(row) / static_cast<long double>(height);
}

std::uint64_t start_of(std::span<const std::uint32_t> ends, std::size_t at) { return at == 0 ? 0 : ends[at - 1]; }

long double share(std::span<const std::uint32_t> ends, std::size_t at) {
    return std::ldexp(static_cast<long double>(ends[at] - start_of(ends, at)), -31);
}

/// How far a fraction of 32 bits lies through an element that counts in units of 31 bits.
long double within(std::uint32_t u, std::span<const std::uint32_t> ends, std::size_t at) {
    const long double start = 2 * static_cast<long double>(start_of(ends, at));
    const long double end = 2 * static_cast<long double>(ends[at]);
    return (static_cast<long double>(u) + 0.5L - start) / (end - start);
}

}  // namespace

std::size_t first_above(std::span<const std::uint32_t> ends, std::uint64_t value) {
    std::size_t at = 0;
    while (at < ends.size() && ends[at] <= value) ++at;
    return at;
}

Drawn draw(const TablesView& tables, std::uint32_t u_row, std::uint32_t u_column) {
    Drawn drawn;
    drawn.row = first_above(tables.marginal, u_row / 2);
    const auto row = tables.conditional.subspan(drawn.row * tables.width, tables.width);
    drawn.column = first_above(row, u_column / 2);
    drawn.down = within(u_row, tables.marginal, drawn.row);
    drawn.along = within(u_column, row, drawn.column);
    drawn.pdf = share(tables.marginal, drawn.row) * share(row, drawn.column) /
                solid_angle(drawn.row, tables.width, tables.height);
    return drawn;
}

long double theta_in_row(std::size_t row, std::size_t height, long double down) {
    // From the nearer pole and by half angles, or the arc cosine would lose half of the digits there.
    const bool south = 2 * row + 1 > height;
    const std::size_t from_pole = south ? height - 1 - row : row;
    const long double part = south ? 1 - down : down;
    const long double near_edge = std::sin(edge(from_pole, height) / 2);
    const long double far_edge = std::sin(edge(from_pole + 1, height) / 2);
    const long double square = near_edge * near_edge + part * (far_edge * far_edge - near_edge * near_edge);
    const long double theta = 2 * std::asin(std::sqrt(square));
    return south ? PI - theta : theta;
}

Vector direction(long double theta, long double phi, long double rotation) {
    const Vector map = {std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
    const long double c = std::cos(rotation);
    const long double s = std::sin(rotation);
    return {map[0] * c - map[2] * s, map[1], map[0] * s + map[2] * c};
}

long double solid_angle(std::size_t row, std::size_t width, std::size_t height) {
    const long double top = edge(row, height);
    const long double bottom = edge(row + 1, height);
    // cos a - cos b = 2 sin((a + b) / 2) sin((b - a) / 2), with the sum's sine folded to the nearer pole.
    const std::size_t from_pole = std::min(row, height - 1 - row);
    const long double middle = (edge(from_pole, height) + edge(from_pole + 1, height)) / 2;
    return 2 * PI / static_cast<long double>(width) * 2 * std::sin(middle) * std::sin((bottom - top) / 2);
}

}  // namespace clerestory::reference
