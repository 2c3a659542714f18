#pragma once

#include <CL/cl.h>

#include <string>

namespace clerestory {

/// The name of an OpenCL error code, such as "CL_OUT_OF_RESOURCES (-5)".
std::string error_name(cl_int code);

}  // namespace clerestory
