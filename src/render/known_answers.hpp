#pragma once

#include <string>

#include "cl/device.hpp"

namespace clerestory {

/// What a device answered to questions whose answers are known.
struct KnownAnswers {
    std::string wrong;   ///< the first wrong one, for a message; empty: none
    std::string failed;  ///< the first question that it failed to answer: whoever needs that will meet the failure
};

/// Asks a device for what is known without it: integer tables, where samples lie, their directions and densities,
/// shaded pixels, integrals, reflectance, numbers below 2^-126. A driver can compile every kernel and still light
/// pictures from the wrong side; this is where it shows.
/// Takes milliseconds, and the compiler's time where nothing was compiled yet.
KnownAnswers ask_known_answers(const Device& device);

/// The same, asked once for each device, driver, layout and kernels: then the program cache knows it, as does an
/// installation for the device that it was built with.
KnownAnswers known_answers(const Device& device);

/// Opens a device for work. Throws DeviceError where it answers wrongly, as Device's constructor does otherwise.
Device open_device(const DeviceOptions& options, const DeviceHooks& hooks = {});

}  // namespace clerestory
