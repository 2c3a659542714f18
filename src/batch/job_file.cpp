#include "batch/job_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>

#include "base/bounded_file.hpp"
#include "batch/batch_limits.hpp"
#include "batch/counting.hpp"
#include "batch/job_text.hpp"
#include "batch/words.hpp"
#include "error.hpp"
#include "picture/picture_file.hpp"
#include "render/method.hpp"
#include "render/picture_limits.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using namespace batch_limits;

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
    std::optional<std::string> text(const toml::node& node, std::size_t most) {
        auto value = node.value_exact<std::string>();
        if (!value || value->empty()) return wrong<std::string>(node, "a string in quotes");
        if (value->size() > most) return wrong<std::string>(node, fmt::format("at most {} bytes", most));
        if (value->find('\0') != std::string::npos) return wrong<std::string>(node, "no zero byte");
        return value;
    }
    std::optional<std::string> word(const toml::node& node, const std::vector<std::string>& known) {
        auto value = node.value_exact<std::string>();
        if (value && std::find(known.begin(), known.end(), *value) != known.end()) return value;
        if (!mistakes_.wanted(place_of(node.source()))) return std::nullopt;
        const std::string near = value ? near_word(*value, known) : "";
        return wrong<std::string>(node, fmt::format("one of {}{}", fmt::join(known, ", "),
                                                    near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)));
    }

    /// Calls `each` with the one value, or with every value of the list.
    void values(const toml::node& node, const std::function<void(const toml::node&)>& each) {
        const toml::array* list = node.as_array();
        if (list == nullptr) return each(node);
        if (list->empty()) mistake(node, "the list is empty; give one value at least");
        for (const toml::node& value : *list) each(value);
    }

    template <class T>
    std::optional<T> wrong(const toml::node& node, const std::string& right) {
        if (!mistakes_.wanted(place_of(node.source()))) return std::nullopt;
        std::string given = kind_of(node);
        if (const auto text = node.value_exact<std::string>()) given = in_quotes(*text);
        if (node.is_number() || node.is_boolean()) given = fmt::format("{}", node_text(node));
        mistake(node, fmt::format("{} is given; it takes {}", given, right));
        return std::nullopt;
    }
    void mistake(const toml::node& node, const std::string& what) {
        mistakes_.add(place_of(node.source()), fmt::format("{}: {}", key_, what));
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
            read.mistake(value, fmt::format("unknown key {} in a range; it takes from, to and step", in_quotes(name)));
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
    const double all = static_cast<double>(out.size()) + count;
    if (all > static_cast<double>(MOST_PICTURES)) {
        return read.mistake(range, fmt::format("gives {:.0f} rotations{}; {} are the most of one batch", all,
                                               out.empty() ? "" : " with those before it", MOST_PICTURES));
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
        out.push_back(ends["from"] + static_cast<double>(i) * step);
    }
}

void read_rotations(Reader& read, const toml::node& node, JobEntry& job) {
    std::vector<double> rotations;
    read.values(node, [&](const toml::node& value) {
        if (const toml::table* range = value.as_table()) return add_range(read, *range, rotations);
        const auto degrees = read.number(value, -limits::LARGEST_ROTATION_DEG, limits::LARGEST_ROTATION_DEG);
        if (degrees) rotations.push_back(*degrees);
    });
    job.rotations = std::move(rotations);
}

void read_outputs(Reader& read, const toml::node& node, JobEntry& job) {
    const std::size_t count = node.is_array() ? node.as_array()->size() : 1;
    if (count > MOST_OUTPUTS) {
        return read.mistake(node, fmt::format("lists {} outputs; {} are the most of a job", count, MOST_OUTPUTS));
    }
    std::vector<Placed<Pattern>> outputs;
    read.values(node, [&](const toml::node& value) {
        const auto text = read.text(value, LONGEST_NAME);
        if (!text) return;
        try {
            check_picture_suffix(*text);
            outputs.push_back({Pattern(*text), place_of(value.source())});
        } catch (const UsageError& error) {
            read.mistake(value, error.what());
        }
    });
    job.outputs = std::move(outputs);
}

/// Reads one key's value into a job.
using KeyRule = std::function<void(Reader&, const toml::node&, JobEntry&)>;

template <class T, class Convert>
KeyRule words(JobList<T> JobEntry::*list, const std::vector<std::string>& known, Convert convert) {
    return [=](Reader& read, const toml::node& node, JobEntry& job) {
        std::vector<T> values;
        read.values(node, [&](const toml::node& value) {
            if (const auto word = read.word(value, known)) values.push_back(convert(*word));
        });
        job.*list = std::move(values);
    };
}

template <class T>
KeyRule wholes(JobList<T> JobEntry::*list, std::uint64_t low, std::uint64_t high) {
    return [=](Reader& read, const toml::node& node, JobEntry& job) {
        std::vector<T> values;
        read.values(node, [&](const toml::node& value) {
            if (const auto number = read.whole(value, low, high)) values.push_back(static_cast<T>(*number));
        });
        job.*list = std::move(values);
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
    std::vector<Placed<std::string>> maps;
    read.values(node, [&](const toml::node& value) {
        if (const auto text = read.text(value, LONGEST_NAME)) maps.push_back({*text, place_of(value.source())});
    });
    job.maps = std::move(maps);
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
             if (const auto text = read.text(node, LONGEST_LAYER)) job.recipe.map.layer = *text;
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
    return near_word(plain, key_names());
}

void unknown_key(Mistakes& mistakes, const toml::key& key) {
    const std::string name(key.str());
    const std::string meant = meant_key(name);
    mistakes.add(place_of(key.source()),
                 meant.empty()
                     ? fmt::format("unknown key {}; a job has {}", in_quotes(name), fmt::join(key_names(), ", "))
                     : fmt::format("unknown key {}; did you mean \"{}\"?", in_quotes(name), meant));
}

/// Keys that no rule is for, as they stand in the file: the words of only the first are made.
void unknown_keys(Mistakes& mistakes, std::vector<const toml::key*> keys) {
    const auto place = [](const toml::key* key) {
        return std::pair(key->source().begin.line, key->source().begin.column);
    };
    std::sort(keys.begin(), keys.end(), [&](auto a, auto b) { return place(a) < place(b); });
    for (const toml::key* key : keys) {
        if (mistakes.wanted(place_of(key->source()))) unknown_key(mistakes, *key);
    }
}

void read_keys(Mistakes& mistakes, const toml::table& table, JobEntry& job) {
    std::vector<const toml::key*> unknown;
    for (const auto& [key, node] : table) {
        const auto rule = key_rules().find(std::string(key.str()));
        if (rule == key_rules().end()) {
            unknown.push_back(&key);
            continue;
        }
        Reader reader(mistakes, rule->first);
        rule->second(reader, node, job);
    }
    unknown_keys(mistakes, std::move(unknown));
}

void check_job(Mistakes& mistakes, const toml::table& table, const JobEntry& job) {
    if (job.maps.empty() && !table.contains("map")) {
        mistakes.add(place_of(table.source()),
                     "the job has no map; write map = \"maps/*.exr\", here or under [defaults]");
    }
    if (job.outputs.empty() && !table.contains("output")) {
        mistakes.add(place_of(table.source()),
                     "the job has no output; write output = \"out/{map}_{rotation:03}.exr\", here or under [defaults]");
    }
}

void key_outside_of_jobs(Mistakes& mistakes, const toml::key& key) {
    if (!mistakes.wanted(place_of(key.source()))) return;
    const std::string name(key.str());
    mistakes.add(place_of(key.source()),
                 key_rules().contains(name)
                     ? fmt::format("\"{}\" stands outside of any job; put it under [defaults] or [[job]]", name)
                     : fmt::format("unknown key {}; a job file has [defaults] and [[job]]", in_quotes(name)));
}

/// The file's jobs, with `defaults` read from it; null where it has none.
const toml::array* read_root(Mistakes& mistakes, const toml::table& root, JobEntry& defaults) {
    const toml::array* jobs = nullptr;
    for (const auto& [key, node] : root) {
        const std::string_view name = key.str();
        if (name == "defaults" && node.is_table()) {
            read_keys(mistakes, *node.as_table(), defaults);
        } else if (name == "job" && node.is_array_of_tables()) {
            jobs = node.as_array();
        } else if (name == "defaults" || name == "job") {
            mistakes.add(place_of(key.source()),
                         fmt::format("{} is {}; write [defaults] once and [[job]] for each job", name, kind_of(node)));
        } else {
            key_outside_of_jobs(mistakes, key);
        }
    }
    if (jobs == nullptr) mistakes.add(Place{}, "there is no job; write one under [[job]]");
    return jobs;
}

std::vector<JobEntry> read_jobs(Mistakes& mistakes, const toml::table& root, std::uint64_t default_seed) {
    JobEntry defaults;
    defaults.recipe.render.sampling.control_degree = DEFAULT_CONTROL_DEGREE;
    defaults.seeds = {default_seed};
    std::vector<JobEntry> entries;
    const toml::array* jobs = read_root(mistakes, root, defaults);
    if (jobs == nullptr) return entries;
    PictureCount pictures;
    for (const toml::node& node : *jobs) {
        const toml::table& table = *node.as_table();
        JobEntry job = defaults;
        job.place = place_of(table.source());
        read_keys(mistakes, table, job);
        check_job(mistakes, table, job);
        try {
            pictures.add(job, std::max<std::size_t>(job.maps.size(), 1));
        } catch (const UsageError& error) {
            mistakes.add(job.place, error.what());
            break;  // the rest could be as large
        }
        entries.push_back(std::move(job));
    }
    return entries;
}

}  // namespace

std::size_t pictures_of_a_map(const JobEntry& entry) {
    // A list whose values are all mistakes counts as one: the others may be long.
    const auto count = [](const auto& list) { return std::max<std::size_t>(list.size(), 1); };
    const auto drawing =
        static_cast<std::size_t>(std::count_if(entry.estimators.begin(), entry.estimators.end(), draws_samples));
    const std::size_t sets =
        saturated_product(saturated_product(count(entry.samples), count(entry.sequences)), count(entry.seeds));
    const std::size_t all = saturated_sum(saturated_product(drawing, sets), count(entry.estimators) - drawing);
    return saturated_product(all, count(entry.rotations));
}

void PictureCount::add(const JobEntry& entry, std::size_t maps) {
    const std::size_t of_entry = saturated_product(pictures_of_a_map(entry), maps);
    if (of_entry > MOST_PICTURES) {
        throw UsageError(
            fmt::format("gives {} pictures; {} are the most of one batch; split the file", of_entry, MOST_PICTURES));
    }
    pictures_ += of_entry;
    if (pictures_ > MOST_PICTURES) {
        throw UsageError(
            fmt::format("the jobs up to this one give {} pictures; {} are the most of one batch; split "
                        "the file",
                        pictures_, MOST_PICTURES));
    }
}

JobFile read_job_file(const fs::path& file, std::uint64_t default_seed) {
    const std::string text = read_bounded(file, MOST_JOB_FILE_BYTES, "a job file");
    check_job_text(file, text);
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
