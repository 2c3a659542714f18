#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "batch/job_file.hpp"
#include "render/picture_recipe.hpp"

namespace clerestory {

/// What tells that a file is still the one that was looked at.
struct FileStamp {
    std::uintmax_t bytes = 0;
    std::int64_t modified_ns = 0;
    std::uint64_t inode = 0;
    bool operator==(const FileStamp&) const = default;
};
/// Throws InputError where there is no such file.
FileStamp file_stamp(const std::filesystem::path& file);

/// A map of the plan, as its header says.
struct PlannedMap {
    std::string file;
    FileStamp stamp;
    std::size_t width = 0;   ///< 0: the file cannot be read; its jobs will say why
    std::size_t height = 0;  ///< as width
};

/// One picture of a batch.
struct Job {
    std::size_t index = 0;  ///< place in the whole plan, from 0
    PictureRecipe recipe;
    std::vector<std::string> outputs;
    std::shared_ptr<const PlannedMap> map;  ///< one for jobs that read it the same way, another for others
    std::uint64_t cost_ns = 0;  ///< estimated time of two cores, with the map's share where it is the map's first job
    std::size_t memory_bytes = 0;  ///< estimated, beside what the process takes by itself
};

/// Jobs in the order in which they run: those that share a map, read the same way, follow one another.
struct Plan {
    std::filesystem::path file;
    std::string digest;  ///< of every job's parameters, map and outputs: equal plans have equal digests
    std::vector<Job> jobs;
    [[nodiscard]] std::uint64_t cost_ns() const;
};

/// Whether two jobs of a plan can share a map in memory and its tables.
bool same_scene(const Job& a, const Job& b);

/// Expands a job file: globs, lists and patterns. Paths start from the job file's folder, outputs from `output_folder`
/// unless that is empty. Throws InputError with a line for every mistake: a map that no file matches, two jobs with one
/// output, an output that would replace a map, the job file or one of `reports`, files that are written beside the
/// pictures.
Plan make_plan(const JobFile& jobs, const std::filesystem::path& output_folder,
               std::span<const std::filesystem::path> reports = {});

/// Part `number` (from 1) of `count`, as contiguous as the maps allow, with an equal share of the cost.
struct Shard {
    std::size_t number = 1;
    std::size_t count = 1;
};
/// Reads "I/N". Throws UsageError.
Shard shard_by_name(const std::string& name);
std::string shard_name(const Shard& shard);

/// The jobs of one shard, which the plan keeps. Every job is in exactly one, whoever asks; shards differ in cost by
/// less than a job.
std::span<const Job> jobs_of_shard(const Plan& plan, const Shard& shard);

}  // namespace clerestory
