#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "reference/draw.hpp"

namespace clerestory::reference {

/// Light from one direction: what it adds to a white diffuse surface that faces it.
struct Light {
    Vector direction{};
    Vector radiance{};
};

/// Radiance of a white diffuse surface of normal `normal`: the lights' sum, each times its cosine above the horizon.
Vector shade(const Vector& normal, std::span<const Light> lights);

/// A sample as a light: radiance / (pi count pdf).
Light light_of_sample(const Vector& direction, const Vector& radiance, long double pdf, std::size_t count);

/// One pixel of the sphere's picture.
struct SpherePixel {
    std::size_t index = 0;  ///< row * size + column
    Vector normal{};
};

/// The pixels of a size x size picture whose centres lie on the unit disc, row by row.
std::vector<SpherePixel> sphere_pixels(std::size_t size);

}  // namespace clerestory::reference
