#pragma once

/// Clerestory's library: load a map, build its tables, draw samples of it, light a sphere with it.
///
///     clerestory::Engine engine;
///     auto city = engine.environment(clerestory::read_map(clerestory::bundled_map()));
///     engine.write("sphere.exr", engine.render(city));
///
/// Functions throw clerestory::Error (error.hpp). Nothing prints, exits or reads the environment.

#include "clerestory/bundled.hpp"
#include "clerestory/comparison.hpp"
#include "clerestory/device.hpp"
#include "clerestory/engine.hpp"
#include "clerestory/error.hpp"
#include "clerestory/image.hpp"
#include "clerestory/inspect.hpp"
#include "clerestory/options.hpp"
#include "clerestory/version.hpp"
