// libFuzzer's target for the reports that `merge` reads: whatever the text, it is joined within the limits of
// docs/batch.md, or refused by an InputError that names the file.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "batch/batch_limits.hpp"
#include "batch/report.hpp"
#include "error.hpp"
#include "run_program.hpp"

namespace {

[[noreturn]] void broken(const std::string& what) {
    std::fprintf(stderr, "broken promise: %s\n", what.c_str());
    std::abort();
}

void expect_bounded(const clerestory::MergedReport& merged) {
    const auto planned = merged.report.at("plan_jobs").get<std::size_t>();
    std::size_t counted = 0;
    for (const auto& count : merged.report.at("counts")) counted += count.get<std::size_t>();
    if (counted != planned) broken("jobs that no status counts");
    if (planned > clerestory::batch_limits::MOST_PICTURES) broken("more jobs than a batch has");
    // Jobs of the report, 20 commands for shards, a line for the rest of them and one for missing jobs.
    if (merged.incomplete.size() > merged.report.at("jobs").size() + 22) broken("more lines than there is to tell");
    for (const auto& line : merged.incomplete) {
        for (const char c : line) {
            if (static_cast<unsigned char>(c) < ' ') broken("a control character in: " + line);
        }
    }
}

}  // namespace

// libFuzzer gives the name.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-*)
    static const clerestory::test::TempFolder folder;
    const std::string file = folder.file("batch.json");
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    try {
        expect_bounded(clerestory::merge_reports({file}));
    } catch (const clerestory::InputError& error) {
        if (std::string(error.what()).rfind(file + ":", 0) != 0) broken("does not name the file");
    } catch (const std::exception& error) {
        broken(std::string("another exception than InputError: ") + error.what());
    }
    return 0;
}
