#include "batch/job_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <system_error>

#include "base/nearest_word.hpp"
#include "base/text_escape.hpp"
#include "error.hpp"
#include "picture/picture_file.hpp"
#include "render/picture_limits.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// A list longer than this is a slip of the step, not a night's work.
constexpr std::size_t MOST_ROTATIONS = 1000000;

Place place_of(const toml::source_region& region) { return {region.begin.line, region.begin.column}; }

std::string kind_of(const toml::node& node) {
    switch (node.type()) {
        case toml::node_type::string:
            return "a string";
        case toml::node_type::integer:
        case toml::node_type::floating_point:
            return "a number";
        case toml::node_type::boolean:
            return "true or false";
        case toml::node_type::array:
            return "a list";
        case toml::node_type::table:
            return "a table";
        default:
            return "a date or time";
    }
}

/// Mistakes found so far. Reading goes on after each, so that one run names them all.
class Mistakes {
  public:
    explicit Mistakes(fs::path file) : file_(std::move(file)) {}
    void add(const Place& place, const std::string& what) {
        lines_.emplace(std::pair(place.line, place.column), located(file_, place, what));
    }
    void add(const toml::node& node, const std::string& what) { add(place_of(node.source()), what); }
    void throw_if_any() const {
        std::vector<std::string> lines;
        for (const auto& [place, line] : lines_) lines.push_back(line);
        if (!lines.empty()) throw InputError(lines);
    }

  private:
    fs::path file_;
    std::multimap<std::pair<std::size_t, std::size_t>, std::string> lines_;  ///< by place
};

/// One value of the file as the type that is wanted, or a mistake.
class Reader {
  public:
    Reader(Mistakes& mistakes, std::string key) : mistakes_(mistakes), key_(std::move(key)) {}

    std::optional<double> number(const toml::node& node, double low, double high) {
        const auto value = node.is_number() ? node.value<double>() : std::nullopt;
        if (value && std::isfinite(*value) && *value >= low && *value <= high) return value;
        return wrong<double>(node, fmt::format("a number from {} to {}", low, high));
    }
    std::optional<std::uint64_t> whole(const toml::node& node, std::uint64_t low, std::uint64_t high) {
        const auto value = node.value_exact<std::int64_t>();
        if (value && *value >= 0 && static_cast<std::uint64_t>(*value) >= low &&
            static_cast<std::uint64_t>(*value) <= high) {
            return static_cast<std::uint64_t>(*value);
        }
        return wrong<std::uint64_t>(node, fmt::format("a whole number from {} to {}", low, high));
    }
    std::optional<bool> flag(const toml::node& node) {
        if (const auto value = node.value_exact<bool>()) return value;
        return wrong<bool>(node, "true or false");
    }
    std::optional<std::string> text(const toml::node& node) {
        auto value = node.value_exact<std::string>();
        if (value && !value->empty()) return value;
        return wrong<std::string>(node, "a string in quotes");
    }
    std::optional<std::string> word(const toml::node& node, const std::vector<std::string>& known) {
        auto value = node.value_exact<std::string>();
        if (value && std::find(known.begin(), known.end(), *value) != known.end()) return value;
        const std::string near = value ? nearest_word(*value, known) : "";
        return wrong<std::string>(node, fmt::format("one of {}{}", fmt::join(known, ", "),
                                                    near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)));
    }

    /// Calls `each` with the one value, or with every value of the list.
    void values(const toml::node& node, const std::function<void(const toml::node&)>& each) {
        const toml::array* list = node.as_array();
        if (list == nullptr) return each(node);
        if (list->empty()) mistakes_.add(node, fmt::format("{}: the list is empty; give one value at least", key_));
        for (const toml::node& value : *list) each(value);
    }

    template <class T>
    std::optional<T> wrong(const toml::node& node, const std::string& right) {
        std::string given = kind_of(node);
        if (const auto text = node.value_exact<std::string>()) given = fmt::format("\"{}\"", *text);
        if (node.is_number() || node.is_boolean()) given = fmt::format("{}", node_text(node));
        mistakes_.add(node, fmt::format("{}: {} is given; it takes {}", key_, given, right));
        return std::nullopt;
    }
    void mistake(const toml::node& node, const std::string& what) {
        mistakes_.add(node, fmt::format("{}: {}", key_, what));
    }

  private:
    static std::string node_text(const toml::node& node) {
        if (const auto whole = node.value_exact<std::int64_t>()) return std::to_string(*whole);
        if (const auto real = node.value_exact<double>()) return fmt::format("{}", *real);
        return node.value_or(false) ? "true" : "false";
    }

    Mistakes& mistakes_;
    std::string key_;
};

/// {from, to, step} as its values; `to` is one of them where a whole number of steps leads there.
void add_range(Reader& read, const toml::table& range, std::vector<double>& out) {
    std::map<std::string, double> ends = {{"step", 1}};
    for (const auto& [key, value] : range) {
        const std::string name(key.str());
        if (name != "from" && name != "to" && name != "step") {
            read.mistake(value, fmt::format("unknown key \"{}\" in a range; it takes from, to and step", name));
            return;
        }
        const auto number = read.number(value, -limits::LARGEST_ROTATION_DEG, limits::LARGEST_ROTATION_DEG);
        if (!number) return;
        ends[name] = *number;
    }
    if (ends.size() != 3) {
        return read.mistake(range, "a range needs from and to, as {from = 0, to = 359, step = 1}");
    }
    const double span = ends["to"] - ends["from"];
    const double step = ends["step"];
    if (step == 0 || span * step < 0) {
        return read.mistake(range, fmt::format("steps of {} never lead from {} to {}; {}", step, ends["from"],
                                               ends["to"], step == 0 ? "choose another" : "change the step's sign"));
    }
    constexpr double ROUNDING = 1e-9;  // of a step: 0.1 does not divide 0.3 in binary
    const double count = std::floor(span / step + ROUNDING) + 1;
    if (count > static_cast<double>(MOST_ROTATIONS)) {
        return read.mistake(range, fmt::format("gives {:.0f} rotations; {} are the most", count, MOST_ROTATIONS));
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
        out.push_back(ends["from"] + static_cast<double>(i) * step);
    }
}

void read_rotations(Reader& read, const toml::node& node, JobEntry& job) {
    job.rotations.clear();
    read.values(node, [&](const toml::node& value) {
        if (const toml::table* range = value.as_table()) return add_range(read, *range, job.rotations);
        const auto degrees = read.number(value, -limits::LARGEST_ROTATION_DEG, limits::LARGEST_ROTATION_DEG);
        if (degrees) job.rotations.push_back(*degrees);
    });
}

void read_outputs(Reader& read, const toml::node& node, JobEntry& job) {
    job.outputs.clear();
    read.values(node, [&](const toml::node& value) {
        const auto text = read.text(value);
        if (!text) return;
        try {
            check_picture_suffix(*text);
            job.outputs.push_back({Pattern(*text), place_of(value.source())});
        } catch (const UsageError& error) {
            read.mistake(value, error.what());
        }
    });
}

/// Reads one key's value into a job.
using KeyRule = std::function<void(Reader&, const toml::node&, JobEntry&)>;

template <class T, class Convert>
KeyRule words(std::vector<T> JobEntry::*list, const std::vector<std::string>& known, Convert convert) {
    return [=](Reader& read, const toml::node& node, JobEntry& job) {
        (job.*list).clear();
        read.values(node, [&](const toml::node& value) {
            if (const auto word = read.word(value, known)) (job.*list).push_back(convert(*word));
        });
    };
}

template <class T>
KeyRule wholes(std::vector<T> JobEntry::*list, std::uint64_t low, std::uint64_t high) {
    return [=](Reader& read, const toml::node& node, JobEntry& job) {
        (job.*list).clear();
        read.values(node, [&](const toml::node& value) {
            if (const auto number = read.whole(value, low, high)) (job.*list).push_back(static_cast<T>(*number));
        });
    };
}

template <class Access>
KeyRule one_number(double low, double high, Access access) {
    return [=](Reader& read, const toml::node& node, JobEntry& job) {
        if (const auto number = read.number(node, low, high)) access(job.recipe) = *number;
    };
}

template <class Access>
KeyRule one_whole(std::uint64_t low, std::uint64_t high, Access access) {
    return [=](Reader& read, const toml::node& node, JobEntry& job) {
        auto& target = access(job.recipe);
        if (const auto number = read.whole(node, low, high)) {
            target = static_cast<std::remove_reference_t<decltype(target)>>(*number);
        }
    };
}

template <class Access>
KeyRule one_word(const std::vector<std::string>& known, Access access) {
    return [=](Reader& read, const toml::node& node, JobEntry& job) {
        if (const auto word = read.word(node, known)) access(job.recipe, *word);
    };
}

void read_maps(Reader& read, const toml::node& node, JobEntry& job) {
    job.maps.clear();
    read.values(node, [&](const toml::node& value) {
        if (const auto text = read.text(value)) job.maps.push_back({*text, place_of(value.source())});
    });
}

/// Every key of a job: the flags of `render`, with _ for -.
const std::map<std::string, KeyRule>& key_rules() {
    using R = PictureRecipe;
    static const std::map<std::string, KeyRule> rules = {
        {"map", read_maps},
        {"flip_y",
         [](Reader& read, const toml::node& node, JobEntry& job) {
             if (const auto flag = read.flag(node)) job.recipe.map.flip_y = *flag;
         }},
        {"luminance", one_word({"average", "rec709"}, [](R& r, const std::string& w) { r.map.luminance = w; })},
        {"bad_texels", one_word({"refuse", "zero"}, [](R& r, const std::string& w) { r.map.bad_texels = w; })},
        {"layer",
         [](Reader& read, const toml::node& node, JobEntry& job) {
             if (const auto text = read.text(node)) job.recipe.map.layer = *text;
         }},
        {"part",
         [](Reader& read, const toml::node& node, JobEntry& job) {
             if (const auto number = read.whole(node, 0, limits::LARGEST_PART)) {
                 job.recipe.map.part = static_cast<int>(*number);
             }
         }},
        {"scale", one_number(0, limits::LARGEST_SCALE, [](R& r) -> double& { return r.map.scale; })},
        {"rotate_y", read_rotations},
        {"samples", wholes(&JobEntry::samples, 1, limits::LARGEST_COUNT)},
        {"estimator", words(&JobEntry::estimators, estimator_names(), estimator_by_name)},
        {"sequence", words(&JobEntry::sequences, sequence_names(), sequence_by_name)},
        {"seed", wholes(&JobEntry::seeds, 0, std::numeric_limits<std::int64_t>::max())},
        {"texel", one_word(texel_place_names(),
                           [](R& r, const std::string& w) { r.render.sampling.place = texel_place_by_name(w); })},
        {"control_degree", one_whole(0, SamplingOptions::MAX_CONTROL_DEGREE,
                                     [](R& r) -> unsigned& { return r.render.sampling.control_degree; })},
        {"degree",
         one_whole(0, HarmonicOptions::MAX_DEGREE, [](R& r) -> std::size_t& { return r.render.harmonic.degree; })},
        {"lights",
         one_whole(0, HarmonicOptions::MAX_LIGHTS, [](R& r) -> std::size_t& { return r.render.harmonic.lights; })},
        {"size", one_whole(1, limits::LARGEST_SIDE, [](R& r) -> std::size_t& { return r.render.size; })},
        {"albedo", one_number(0, limits::LARGEST_ALBEDO, [](R& r) -> double& { return r.render.albedo; })},
        {"exposure", one_number(0, limits::LARGEST_EXPOSURE, [](R& r) -> double& { return r.tone.exposure; })},
        {"gamma",
         one_number(1 / limits::LARGEST_GAMMA, limits::LARGEST_GAMMA, [](R& r) -> double& { return r.tone.gamma; })},
        {"output", read_outputs}};
    return rules;
}

std::vector<std::string> key_names() {
    std::vector<std::string> names;
    for (const auto& [name, rule] : key_rules()) names.push_back(name);
    return names;
}

/// The key that was meant where another word for it was written.
std::string meant_key(const std::string& wrong) {
    static const std::map<std::string, std::string> other_words = {
        {"rotation", "rotate_y"}, {"rotations", "rotate_y"}, {"count", "samples"}, {"counts", "samples"},
        {"n", "samples"},         {"file", "map"},           {"files", "map"},     {"glob", "map"},
        {"out", "output"},        {"pattern", "output"}};
    std::string plain = wrong;
    std::replace(plain.begin(), plain.end(), '-', '_');
    if (const auto found = other_words.find(plain); found != other_words.end()) return found->second;
    return nearest_word(plain, key_names());
}

void read_keys(Mistakes& mistakes, const toml::table& table, JobEntry& job) {
    for (const auto& [key, node] : table) {
        const std::string name(key.str());
        const auto rule = key_rules().find(name);
        if (rule != key_rules().end()) {
            Reader reader(mistakes, name);
            rule->second(reader, node, job);
            continue;
        }
        const std::string meant = meant_key(name);
        mistakes.add(place_of(key.source()),
                     meant.empty() ? fmt::format("unknown key \"{}\"; a job has {}", name, fmt::join(key_names(), ", "))
                                   : fmt::format("unknown key \"{}\"; did you mean \"{}\"?", name, meant));
    }
}

void check_job(Mistakes& mistakes, const toml::table& table, const JobEntry& job) {
    if (job.maps.empty() && !table.contains("map")) {
        mistakes.add(table, "the job has no map; write map = \"maps/*.exr\", here or under [defaults]");
    }
    if (job.outputs.empty() && !table.contains("output")) {
        mistakes.add(table,
                     "the job has no output; write output = \"out/{map}_{rotation:03}.exr\", here or under [defaults]");
    }
}

std::vector<JobEntry> read_jobs(Mistakes& mistakes, const toml::table& root, std::uint64_t default_seed) {
    JobEntry defaults;
    defaults.recipe.render.sampling.control_degree = DEFAULT_CONTROL_DEGREE;
    defaults.seeds = {default_seed};
    const toml::array* jobs = nullptr;
    for (const auto& [key, node] : root) {
        const std::string name(key.str());
        if (name == "defaults" && node.is_table()) {
            read_keys(mistakes, *node.as_table(), defaults);
        } else if (name == "job" && node.is_array_of_tables()) {
            jobs = node.as_array();
        } else if (name == "defaults" || name == "job") {
            mistakes.add(place_of(key.source()),
                         fmt::format("{} is {}; write [defaults] once and [[job]] for each job", name, kind_of(node)));
        } else {
            const bool of_job = key_rules().contains(name);
            mistakes.add(place_of(key.source()),
                         of_job
                             ? fmt::format("\"{}\" stands outside of any job; put it under [defaults] or [[job]]", name)
                             : fmt::format("unknown key \"{}\"; a job file has [defaults] and [[job]]", name));
        }
    }
    std::vector<JobEntry> entries;
    if (jobs == nullptr) {
        mistakes.add(Place{}, "there is no job; write one under [[job]]");
        return entries;
    }
    for (const toml::node& node : *jobs) {
        const toml::table& table = *node.as_table();
        JobEntry job = defaults;
        job.place = place_of(table.source());
        read_keys(mistakes, table, job);
        check_job(mistakes, table, job);
        entries.push_back(std::move(job));
    }
    return entries;
}

std::string text_of(const fs::path& file) {
    std::error_code error;
    if (fs::is_directory(file, error)) {
        throw InputError(fmt::format("{}: is a folder; name a job file", file.string()));
    }
    std::ifstream in(file, std::ios::binary);
    if (!in) {
        throw InputError(fmt::format("{}: cannot be opened: {}; check the path", file.string(),
                                     std::generic_category().message(errno)));
    }
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

std::string located(const fs::path& file, const Place& place, const std::string& what) {
    return fmt::format("{}:{}:{}: {}", file.string(), place.line, place.column, what);
}

JobFile read_job_file(const fs::path& file, std::uint64_t default_seed) {
    const std::string text = text_of(file);
    Mistakes mistakes(file);
    try {
        JobFile jobs{file, read_jobs(mistakes, toml::parse(text), default_seed)};
        mistakes.throw_if_any();
        return jobs;
    } catch (const toml::parse_error& error) {
        throw InputError(located(file, place_of(error.source()), fmt::format("{}", error.description())));
    }
}

}  // namespace clerestory
