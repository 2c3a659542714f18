#include "cl/program.hpp"

#include <fmt/format.h>

#include <optional>
#include <set>
#include <sstream>
#include <utility>

#include "cl/error_name.hpp"
#include "cl/kernel_sources.hpp"
#include "cl/pocl_bitcode.hpp"
#include "cl/precompiled.hpp"
#include "error.hpp"

namespace clerestory {
namespace {

// No warnings: PoCL has its compiler print them to stderr, where a user could do nothing about them.
constexpr const char* BUILD_OPTIONS = "-cl-std=CL1.2 -cl-kernel-arg-info -w";

/// The name in a line of the form `#include "name"`, else empty.
std::string_view included_name(std::string_view line) {
    constexpr std::string_view lead = "#include \"";
    if (line.substr(0, lead.size()) != lead) return {};
    const auto end = line.find('"', lead.size());
    return line.substr(lead.size(), end - lead.size());
}

void assemble(std::string_view file, std::set<std::string, std::less<>>& seen, std::string& out) {
    const auto& sources = cl_source::all();
    const auto found = sources.find(file);
    if (found == sources.end()) throw DeviceError(fmt::format("no kernel source named {}", file));
    if (!seen.emplace(file).second) return;
    out += fmt::format("#line 1 \"kernels/{}\"\n", file);
    std::istringstream lines(found->second);
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
        const auto name = included_name(line);
        if (name.empty()) {
            out += line;
            out += '\n';
            continue;
        }
        assemble(name, seen, out);
        out += fmt::format("#line {} \"kernels/{}\"\n", number + 1, file);
    }
}

}  // namespace

std::string assembled_source(std::string_view file) {
    std::set<std::string, std::less<>> seen;
    std::string out;
    assemble(file, seen, out);
    return out;
}

namespace {

/// The program of a binary; nothing where the driver does not take it.
std::optional<cl::Program> program_of(const Device& device, const std::vector<unsigned char>& binary,
                                      const std::string& options) {
    try {
        cl::Program program(device.context(), {device.handle()}, {binary});
        program.build(device.handle(), options.c_str());
        return program;
    } catch (const cl::Error&) {
        return std::nullopt;
    }
}

/// The program as it was compiled ahead, else as the cache keeps it, compiled for it first where PoCL does so; nothing
/// where that is no way to it.
std::optional<cl::Program> program_by_binary(const Device& device, const std::string& source, const std::string& key,
                                             const std::string& options) {
    if (const auto ahead = precompiled_program(key)) {
        if (auto program = program_of(device, *ahead, options)) return program;
    }
    if (const auto kept = device.program_cache().load(key)) {
        if (auto program = program_of(device, *kept, options)) return program;
    }
    if (!has_clang_builtins(device.info())) return std::nullopt;
    const auto bitcode = compile_to_bitcode(device, source, options);
    if (!bitcode) return std::nullopt;
    auto program = program_of(device, *bitcode, options);
    if (program) device.program_cache().store(key, *bitcode);
    return program;
}

/// The program as its source is compiled now, kept for the next time. Throws as Program's constructor does.
cl::Program program_by_source(const Device& device, std::string_view file, const std::string& source,
                              const std::string& key, const std::string& options) {
    try {
        cl::Program program(device.context(), source);
        program.build(device.handle(), options.c_str());
        const auto binaries = program.getInfo<CL_PROGRAM_BINARIES>();
        if (binaries.size() == 1) device.program_cache().store(key, binaries.front());
        return program;
    } catch (const cl::BuildError& error) {
        std::vector<std::string> lines = {
            fmt::format("building kernels/{} on {} failed: {}", file, device.info().name, error_name(error.err()))};
        for (const auto& [unused, log] : error.getBuildLog()) {
            std::istringstream text(log);
            for (std::string line; std::getline(text, line);) lines.push_back(line);
        }
        throw DeviceError(lines);
    } catch (const cl::Error& error) {
        throw DeviceError(fmt::format("building kernels/{} on {} failed in {}: {}", file, device.info().name,
                                      error.what(), error_name(error.err())));
    }
}

}  // namespace

std::string build_options(const Device& device, const std::string& defines) {
    const DeviceTraits& traits = device.traits();  // see kernels/inline.clh
    return fmt::format("{} -DCLANG_BUILTINS={:d} -DSTREAMING_STORES={:d} {}", BUILD_OPTIONS, traits.clang_builtins,
                       traits.streaming_stores, defines);
}

std::string program_key(const Device& device, const std::string& source, const std::string& defines) {
    const DeviceInfo& info = device.info();
    return fmt::format("{}\n{}\n{}\n{}\n{}\n{}", info.platform, info.version, info.name, info.driver,
                       build_options(device, defines), source);
}

Program::Program(const Device& device, std::string_view file, const std::string& defines) : file_(file) {
    const std::string options = build_options(device, defines);
    const std::string source = assembled_source(file);
    const std::string key = program_key(device, source, defines);
    auto found = program_by_binary(device, source, key, options);
    program_ = found ? std::move(*found) : program_by_source(device, file, source, key, options);
    if (device.precompilation()) device.precompilation()->add(key, program_);
}

}  // namespace clerestory
