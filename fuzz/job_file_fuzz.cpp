// libFuzzer's target for job files: whatever the text, reading gives jobs that keep the ranges of docs/batch.md, or
// InputError whose lines each name the file.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "batch/job_file.hpp"
#include "error.hpp"
#include "run_program.hpp"

namespace {

[[noreturn]] void broken(const std::string& what) {
    std::fprintf(stderr, "broken promise: %s\n", what.c_str());
    std::abort();
}

void expect_every_line_to_name(const std::string& file, const std::string& message) {
    std::istringstream lines(message);
    std::string line;
    if (message.empty()) broken("an error without a word");
    while (std::getline(lines, line)) {
        if (line.rfind(file + ":", 0) != 0) broken("does not name the file: " + line);
    }
}

}  // namespace

// libFuzzer gives the name.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-*)
    static const clerestory::test::TempFolder folder;
    const std::string file = folder.file("jobs.toml");
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    try {
        const clerestory::JobFile jobs = clerestory::read_job_file(file, 1);
        for (const auto& job : jobs.jobs) {
            if (job.maps.empty() || job.outputs.empty()) broken("a job without maps or outputs");
            if (job.samples.empty() || job.rotations.empty()) broken("a job without pictures");
        }
    } catch (const clerestory::InputError& error) {
        expect_every_line_to_name(file, error.what());
    } catch (const std::exception& error) {
        broken(std::string("another exception than InputError: ") + error.what());
    }
    return 0;
}
