#pragma once

#include <climits>
#include <cstddef>

/// What a job file or a report may ask for. Both may come from anybody: what is larger is refused, with its number,
/// before it takes time or memory. docs/batch.md names those that a person may meet.
namespace clerestory::batch_limits {

/// Of one batch, and parts that it can be divided into: plan and report together take 3 KB each.
inline constexpr std::size_t MOST_PICTURES = 200000;
/// Of all names of maps and outputs together; 335 a picture where there are that many.
inline constexpr std::size_t MOST_NAME_BYTES = std::size_t{64} << 20;
inline constexpr std::size_t MOST_OUTPUTS = 16;  ///< of a job
inline constexpr std::size_t LONGEST_NAME = PATH_MAX - 1;
inline constexpr std::size_t LONGEST_LAYER = 255;  ///< that EXR can name

/// toml++ takes up to 2 s for a file of this size.
inline constexpr std::size_t MOST_JOB_FILE_BYTES = std::size_t{2} << 20;
/// Brackets and braces within one another, and parts of a dotted key: toml++ destroys tables by recursion.
inline constexpr std::size_t DEEPEST = 16;
/// Table headers, and tables within dotted keys: toml++ looks through all of them for some.
inline constexpr std::size_t MOST_TABLES = 20000;

/// Of a map's pattern, by its braces; glob(3) makes every one, whether there is such a file or not.
inline constexpr std::size_t MOST_ALTERNATIVES = 4096;
/// In a pattern: glob(3) goes through folders, and from one pair of braces to the next, by recursion.
inline constexpr std::size_t MOST_FOLDERS = 100;
inline constexpr std::size_t MOST_BRACES = 64;
/// Names that the patterns of a batch may be held against.
inline constexpr std::size_t MOST_NAMES_SEEN = 500000;

inline constexpr std::size_t MOST_MISTAKES = 20;  ///< that are told; the first by place

/// Of a report: MOST_PICTURES jobs, each with MOST_NAME_BYTES' share and as much again for the rest.
inline constexpr std::size_t MOST_REPORT_BYTES = std::size_t{256} << 20;
inline constexpr std::size_t DEEPEST_REPORT = 8;
inline constexpr std::size_t MOST_JOB_VALUES = 64;  ///< of one job's entry there; `batch` writes 40 at most

}  // namespace clerestory::batch_limits
