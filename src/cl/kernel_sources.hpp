#pragma once

#include <functional>
#include <map>
#include <string>

namespace clerestory::cl_source {

/// Every file of kernels/, by name.
const std::map<std::string, std::string, std::less<>>& all();

}  // namespace clerestory::cl_source
