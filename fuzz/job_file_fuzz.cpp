// libFuzzer's target for job files: whatever the text, reading and planning give jobs that keep the ranges and limits
// of docs/batch.md, or InputError whose lines each name the file. What passes the look at the text before it is parsed
// is not deep, as toml++ sees it.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include <toml++/toml.h>

#include "batch/batch_limits.hpp"
#include "batch/job_file.hpp"
#include "batch/job_text.hpp"
#include "batch/plan.hpp"
#include "error.hpp"
#include "run_program.hpp"

namespace {

using clerestory::batch_limits::DEEPEST;
using clerestory::batch_limits::MOST_PICTURES;

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

/// Tables and lists within one another.
std::size_t depth_of(const toml::node& node) {
    std::size_t deepest = 0;
    if (const auto* table = node.as_table()) {
        for (const auto& [key, value] : *table) deepest = std::max(deepest, depth_of(value));
        return deepest + 1;
    }
    if (const auto* list = node.as_array()) {
        for (const auto& value : *list) deepest = std::max(deepest, depth_of(value));
        return deepest + 1;
    }
    return 0;
}

void expect_shallow(const std::string& file, const std::string& text) {
    try {
        clerestory::check_job_text(file, text);
        // A header's parts, and those of a key at every level of brackets; [[x]] is a list and a table.
        constexpr std::size_t MOST = 2 * DEEPEST + DEEPEST * (DEEPEST + 1);
        if (depth_of(toml::parse(text)) > MOST) broken("deeper than the text looked");
    } catch (const clerestory::InputError&) {
    } catch (const toml::parse_error&) {
    }
}

/// Whether a plan is quick to make: maps are looked for among two files, rather than on the disk, and are few.
bool is_small(const clerestory::JobFile& jobs) {
    constexpr std::size_t MOST_PLANNED = 1000;
    std::size_t pictures = 0;
    for (const auto& job : jobs.jobs) {
        pictures += clerestory::pictures_of_a_map(job) * job.maps.size();
        for (const auto& map : job.maps) {
            if (map.value.find('/') != std::string::npos) return false;
        }
    }
    return pictures <= MOST_PLANNED;
}

}  // namespace

// libFuzzer gives the name.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-*)
    static const clerestory::test::TempFolder folder;
    const std::string file = folder.file("jobs.toml");
    std::ofstream(folder.file("a")).put('a');  // a map that cannot be read, which is its jobs' own failure
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    expect_shallow(file, {reinterpret_cast<const char*>(data), size});
    try {
        const clerestory::JobFile jobs = clerestory::read_job_file(file, 1);
        for (const auto& job : jobs.jobs) {
            if (job.maps.empty() || job.outputs.empty()) broken("a job without maps or outputs");
            if (job.samples.empty() || job.rotations.empty()) broken("a job without pictures");
        }
        std::size_t pictures = 0;
        for (const auto& job : jobs.jobs) pictures += clerestory::pictures_of_a_map(job);
        if (pictures > MOST_PICTURES) broken("more pictures than a batch has");
        if (is_small(jobs)) clerestory::make_plan(jobs, {});
    } catch (const clerestory::InputError& error) {
        expect_every_line_to_name(file, error.what());
    } catch (const std::exception& error) {
        broken(std::string("another exception than InputError: ") + error.what());
    }
    return 0;
}
