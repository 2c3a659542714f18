#pragma once

#include <string>
#include <vector>

#include "engine.hpp"
#include "sampling/stage3_sample.hpp"
#include "tables/stage2_cdf.hpp"

namespace clerestory {

/// Reads a sample set back from the device.
std::vector<SampleRecord> sample_records(const SampleSet& set, const Distribution& distribution);

/// `index,row,column,theta,phi,x,y,z,pdf,r,g,b`, a line a sample; every number reads back to the same value.
std::string samples_csv(const std::vector<SampleRecord>& records);

}  // namespace clerestory
