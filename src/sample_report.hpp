#pragma once

#include <string>
#include <vector>

#include "distribution.hpp"
#include "samples.hpp"

namespace clerestory {

/// One sample with its density in double, straight from the integer tables.
struct SampleRecord {
    std::size_t row = 0;
    std::size_t column = 0;
    double theta = 0;  ///< radians from +y
    double phi = 0;    ///< radians, the rotation applied, in [0, 2 pi)
    float direction[3] = {};
    double pdf = 0;  ///< per steradian
    float rgb[3] = {};
};

/// Reads a sample set back from the device.
std::vector<SampleRecord> sample_records(const SampleSet& set, const Distribution& distribution);

/// `index,row,column,theta,phi,x,y,z,pdf,r,g,b`, a line a sample; every number reads back to the same value.
std::string samples_csv(const std::vector<SampleRecord>& records);

}  // namespace clerestory
