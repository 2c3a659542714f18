#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "batch/mistakes.hpp"
#include "batch/pattern.hpp"
#include "render/picture_recipe.hpp"

namespace clerestory {

/// A value with the place where it stands, for messages about it.
template <class T>
struct Placed {
    T value;
    Place place;
};

/// A list that does not change any more and that its copies share: a file's jobs all have the lists of its defaults.
template <class T>
class JobList {
  public:
    using value_type = T;
    using const_iterator = typename std::vector<T>::const_iterator;

    JobList(std::initializer_list<T> values = {}) : JobList(std::vector<T>(values)) {}
    JobList(std::vector<T> values) : values_(std::make_shared<const std::vector<T>>(std::move(values))) {}

    [[nodiscard]] const_iterator begin() const { return values_->begin(); }
    [[nodiscard]] const_iterator end() const { return values_->end(); }
    [[nodiscard]] std::size_t size() const { return values_->size(); }
    [[nodiscard]] bool empty() const { return values_->empty(); }
    const T& operator[](std::size_t i) const { return (*values_)[i]; }

  private:
    std::shared_ptr<const std::vector<T>> values_;
};

/// One [[job]] with the file's defaults filled in: every combination of its lists is a picture.
struct JobEntry {
    Place place;
    PictureRecipe recipe;  ///< all but what the lists below decide
    JobList<Placed<std::string>> maps;
    JobList<double> rotations = {0};
    JobList<std::size_t> samples = {RenderOptions{}.samples};
    JobList<Estimator> estimators = {Estimator::shared};
    JobList<Sequence> sequences = {Sequence::random};
    JobList<std::uint64_t> seeds;
    JobList<Placed<Pattern>> outputs;
};

/// How many pictures an entry's lists give of one map, at most the largest number there is. An estimator that draws
/// nothing gives one, whatever the lists of samples, sequences and seeds.
std::size_t pictures_of_a_map(const JobEntry& entry);

/// Adds up the pictures of a batch, entry by entry.
class PictureCount {
  public:
    /// Throws UsageError saying the number where there are more than a batch may have.
    void add(const JobEntry& entry, std::size_t maps);

  private:
    std::size_t pictures_ = 0;
};

struct JobFile {
    std::filesystem::path file;
    std::vector<JobEntry> jobs;
};

/// Reads a job file and checks all of it: size, syntax, keys, types, ranges, names. docs/batch.md is its reference.
///   default_seed  of jobs that name none
/// Throws InputError with a line for each of the first mistakes: its place, what is wrong and what would be right.
JobFile read_job_file(const std::filesystem::path& file, std::uint64_t default_seed);

}  // namespace clerestory
