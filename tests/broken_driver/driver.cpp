// An OpenCL driver that the loader takes and that then fails, in the way that CLERESTORY_BROKEN_DRIVER names:
//   platform  it does not say what it is
//   devices   it cannot list its devices
//   device    it has a device and says nothing of it
//   crash     whoever makes a context gets a signal
#define CL_TARGET_OPENCL_VERSION 300
#include <CL/cl.h>
#include <CL/cl_ext.h>
#include <CL/cl_icd.h>

#include <cstdlib>
#include <cstring>
#include <string_view>

struct _cl_platform_id {  // NOLINT: OpenCL's own name
    cl_icd_dispatch* dispatch;
};
struct _cl_device_id {  // NOLINT
    cl_icd_dispatch* dispatch;
};

namespace {

bool fails_in(std::string_view mode) {
    const char* value = std::getenv("CLERESTORY_BROKEN_DRIVER");
    return value != nullptr && value == mode;
}

cl_int give(const void* from, std::size_t bytes, std::size_t room, void* to, std::size_t* needed) {
    if (needed != nullptr) *needed = bytes;
    if (to == nullptr) return CL_SUCCESS;
    if (room < bytes) return CL_INVALID_VALUE;
    std::memcpy(to, from, bytes);
    return CL_SUCCESS;
}

cl_int give(const char* text, std::size_t room, void* to, std::size_t* needed) {
    return give(text, std::strlen(text) + 1, room, to, needed);
}

cl_int CL_API_CALL platform_info(cl_platform_id /*platform*/, cl_platform_info name, std::size_t room, void* to,
                                 std::size_t* needed) {
    switch (name) {
        case CL_PLATFORM_EXTENSIONS:
            return give("cl_khr_icd", room, to, needed);
        case CL_PLATFORM_ICD_SUFFIX_KHR:
            return give("BRK", room, to, needed);
        case CL_PLATFORM_NAME:
            return fails_in("platform") ? CL_OUT_OF_HOST_MEMORY : give("Broken driver", room, to, needed);
        case CL_PLATFORM_VERSION:
            return fails_in("platform") ? CL_OUT_OF_HOST_MEMORY : give("OpenCL 3.0 broken", room, to, needed);
        default:
            return CL_INVALID_VALUE;
    }
}

cl_icd_dispatch& dispatch();

cl_int CL_API_CALL device_ids(cl_platform_id /*platform*/, cl_device_type /*type*/, cl_uint room, cl_device_id* to,
                              cl_uint* found) {
    static _cl_device_id device{&dispatch()};
    if (fails_in("devices")) return CL_OUT_OF_RESOURCES;
    if (found != nullptr) *found = 1;
    if (to != nullptr && room > 0) *to = &device;
    return CL_SUCCESS;
}

/// What a device must say to be taken for a GPU that works.
cl_int CL_API_CALL device_info(cl_device_id /*device*/, cl_device_info name, std::size_t room, void* to,
                               std::size_t* needed) {
    if (fails_in("device")) return CL_INVALID_DEVICE;
    const cl_device_type type = CL_DEVICE_TYPE_GPU;
    const cl_ulong bytes = cl_ulong{1} << 30;
    const cl_uint one = 1;
    const std::size_t group = 64;
    const cl_bitfield config = CL_FP_DENORM;
    switch (name) {
        case CL_DEVICE_NAME:
            return give("Broken device", room, to, needed);
        case CL_DRIVER_VERSION:
            return give("0", room, to, needed);
        case CL_DEVICE_VERSION:
            return give("OpenCL 1.1 broken", room, to, needed);
        case CL_DEVICE_TYPE:
            return give(&type, sizeof(type), room, to, needed);
        case CL_DEVICE_MAX_COMPUTE_UNITS:
        case CL_DEVICE_COMPILER_AVAILABLE:
            return give(&one, sizeof(one), room, to, needed);
        case CL_DEVICE_MAX_WORK_GROUP_SIZE:
            return give(&group, sizeof(group), room, to, needed);
        case CL_DEVICE_GLOBAL_MEM_SIZE:
        case CL_DEVICE_LOCAL_MEM_SIZE:
        case CL_DEVICE_MAX_MEM_ALLOC_SIZE:
            return give(&bytes, sizeof(bytes), room, to, needed);
        case CL_DEVICE_SINGLE_FP_CONFIG:
        case CL_DEVICE_DOUBLE_FP_CONFIG:
            return give(&config, sizeof(config), room, to, needed);
        default:
            return CL_INVALID_VALUE;
    }
}

cl_int CL_API_CALL retain_or_release(cl_device_id /*device*/) { return CL_SUCCESS; }

cl_context CL_API_CALL no_context(const cl_context_properties* /*properties*/, cl_uint /*count*/,
                                  const cl_device_id* /*devices*/,
                                  void(CL_CALLBACK* /*notify*/)(const char*, const void*, std::size_t, void*),
                                  void* /*data*/, cl_int* error) {
    if (fails_in("crash")) std::abort();
    if (error != nullptr) *error = CL_OUT_OF_RESOURCES;
    return nullptr;
}

cl_icd_dispatch& dispatch() {
    static cl_icd_dispatch table = [] {
        cl_icd_dispatch made{};
        made.clGetPlatformInfo = platform_info;
        made.clGetDeviceIDs = device_ids;
        made.clGetDeviceInfo = device_info;
        made.clRetainDevice = retain_or_release;
        made.clReleaseDevice = retain_or_release;
        made.clCreateContext = no_context;
        return made;
    }();
    return table;
}

cl_int CL_API_CALL platform_ids(cl_uint room, cl_platform_id* to, cl_uint* found) {
    static _cl_platform_id platform{&dispatch()};
    if (found != nullptr) *found = 1;
    if (to != nullptr && room > 0) *to = &platform;
    return CL_SUCCESS;
}

}  // namespace

extern "C" {

__attribute__((visibility("default"))) void* CL_API_CALL clGetExtensionFunctionAddress(const char* name) {
    return std::string_view(name) == "clIcdGetPlatformIDsKHR" ? reinterpret_cast<void*>(&platform_ids) : nullptr;
}

__attribute__((visibility("default"))) cl_int CL_API_CALL clGetPlatformInfo(cl_platform_id platform,
                                                                            cl_platform_info name, std::size_t room,
                                                                            void* to, std::size_t* needed) {
    return platform_info(platform, name, room, to, needed);
}

__attribute__((visibility("default"))) cl_int CL_API_CALL clIcdGetPlatformIDsKHR(cl_uint room, cl_platform_id* to,
                                                                                 cl_uint* found) {
    return platform_ids(room, to, found);
}

}  // extern "C"
