#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace clerestory {

/// What an output's name may hold of its job.
struct PatternValues {
    std::string map;     ///< the map's file name without suffix
    std::string folder;  ///< the name of the folder that the map lies in
    double rotation = 0;
    std::size_t frame = 0;               ///< place of the rotation among the job's rotations, from 0
    std::optional<std::size_t> samples;  ///< nothing for estimators that draw none, as for sequence and seed
    std::string estimator;
    std::string sequence;
    std::optional<std::uint64_t> seed;
    std::size_t size = 0;
};

/// The name of an output, with fields in braces: {map}_{rotation:03}_{samples}.exr. Of numbers, {rotation:03} pads the
/// whole part with zeros to three digits and {rotation:05.1} gives one digit after the point as well; {{ and }} are
/// braces. A value that its job does not have is "none".
class Pattern {
  public:
    /// Throws UsageError saying which field is wrong and what would be right.
    explicit Pattern(const std::string& text);

    [[nodiscard]] std::string expand(const PatternValues& values) const;
    [[nodiscard]] const std::string& text() const noexcept { return text_; }

    /// Every field's name.
    static const std::vector<std::string>& fields();

  private:
    struct Part {
        std::string literal;           ///< used where `field` is empty
        std::string field;             ///< name without braces
        std::size_t width = 0;         ///< least digits of the whole part
        std::optional<int> precision;  ///< digits after the point
    };
    void add_field(const std::string& inside);

    std::string text_;
    std::vector<Part> parts_;
};

}  // namespace clerestory
