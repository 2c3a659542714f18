#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "batch/pattern.hpp"
#include "render/picture_recipe.hpp"

namespace clerestory {

/// A place in the job file, counted from 1.
struct Place {
    std::size_t line = 1;
    std::size_t column = 1;
};

/// A value with the place where it stands, for messages about it.
template <class T>
struct Placed {
    T value;
    Place place;
};

/// One [[job]] with the file's defaults filled in: every combination of its lists is a picture.
struct JobEntry {
    Place place;
    PictureRecipe recipe;  ///< all but what the lists below decide
    std::vector<Placed<std::string>> maps;
    std::vector<double> rotations = {0};
    std::vector<std::size_t> samples = {RenderOptions{}.samples};
    std::vector<Estimator> estimators = {Estimator::shared};
    std::vector<Sequence> sequences = {Sequence::random};
    std::vector<std::uint64_t> seeds;
    std::vector<Placed<Pattern>> outputs;
};

struct JobFile {
    std::filesystem::path file;
    std::vector<JobEntry> jobs;
};

/// "file:line:column: what", as compilers write it: one line, whatever the file's own words hold.
std::string located(const std::filesystem::path& file, const Place& place, const std::string& what);

/// Reads a job file and checks all of it: syntax, keys, types, ranges, names. docs/batch.md is its reference.
///   default_seed  of jobs that name none
/// Throws InputError with one line for every mistake: its place, what is wrong and what would be right.
JobFile read_job_file(const std::filesystem::path& file, std::uint64_t default_seed);

}  // namespace clerestory
