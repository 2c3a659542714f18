#include "batch/plan.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <charconv>
#include <deque>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "base/digest.hpp"
#include "base/json_text.hpp"
#include "base/output_check.hpp"
#include "batch/batch_limits.hpp"
#include "batch/cost.hpp"
#include "batch/map_glob.hpp"
#include "batch/words.hpp"
#include "error.hpp"
#include "map/image_source.hpp"
#include "render/method.hpp"

namespace clerestory {
namespace {

/// Equal for jobs that share a map in memory and its tables.
std::string scene_key(const MapOptions& options) {
    return options.file + '\n' + json_text(describe_reading(options), -1);
}

namespace fs = std::filesystem;
using namespace batch_limits;

/// What a map that cannot be read is taken for in costs; its jobs fail at once, so it hardly matters.
constexpr std::size_t UNREADABLE_WIDTH = 1024;
constexpr std::size_t UNREADABLE_HEIGHT = 512;

/// A path of the job file as seen from here.
std::string from_folder(const fs::path& folder, const std::string& path) {
    return (fs::path(path).is_absolute() ? fs::path(path) : folder / path).lexically_normal().string();
}

class Planner {
  public:
    Planner(const JobFile& jobs, const fs::path& output_folder, std::span<const fs::path> reports)
        : jobs_(jobs),
          folder_(jobs.file.parent_path()),
          output_folder_(output_folder.empty() ? folder_ : output_folder),
          mistakes_(jobs.file) {
        keep(jobs.file, "the job file");
        for (const fs::path& report : reports) keep(report, "a report of this batch");
    }

    Plan plan() {
        for (const JobEntry& entry : jobs_.jobs) add_entry(entry);
        for (const auto& [key, map] : maps_) keep(map->file, "a map of this batch");
        if (mistakes_.empty()) check_files_are_kept();
        mistakes_.throw_if_any();
        Plan plan{jobs_.file, {}, sorted_jobs()};
        // Their memory is wanted for the digest, which sees every job's words at once.
        drafts_.clear();
        owners_.clear();
        add_costs(plan.jobs);
        plan.digest = digest_of_plan(plan.jobs);
        return plan;
    }

  private:
    void mistake(const Place& place, const std::string& what) {
        mistakes_.add(place, what);
        if (mistakes_.full()) mistakes_.throw_if_any();
    }
    /// Ends planning: what comes after a bound was passed would only take more.
    [[noreturn]] void refuse(const Place& place, const std::string& what) {
        mistakes_.add(place, what);
        mistakes_.throw_if_any();
        throw InputError(located(jobs_.file, place, what));
    }

    void add_entry(const JobEntry& entry) {
        std::vector<std::string> maps;
        for (const auto& map : entry.maps) add_files(map, maps);
        try {
            pictures_.add(entry, maps.size());
        } catch (const UsageError& error) {
            refuse(entry.place, error.what());
        }
        for (const auto& map : maps) add_map(entry, map);
    }

    /// Files that a shell's pattern matches, sorted by bytes.
    void add_files(const Placed<std::string>& pattern, std::vector<std::string>& maps) {
        const std::string path = from_folder(folder_, pattern.value);
        std::vector<std::string> files;
        try {
            files = glob_.files(path);
        } catch (const UsageError& error) {
            refuse(pattern.place, fmt::format("map: {}", error.what()));
        }
        std::error_code error;
        if (files.empty() && fs::exists(path, error)) files = {path};  // a name with brackets in it
        std::erase_if(files, [&](const std::string& file) { return fs::is_directory(file, error); });
        if (files.empty()) {
            mistake(pattern.place, fmt::format("map: no file is named {}; check the path", shortened(path)));
        }
        if (files.size() + maps.size() > MOST_PICTURES) {
            refuse(pattern.place, fmt::format("map: {} files are found; {} pictures are the most of one batch",
                                              files.size() + maps.size(), MOST_PICTURES));
        }
        std::move(files.begin(), files.end(), std::back_inserter(maps));
    }

    void add_map(const JobEntry& entry, const std::string& file) {
        PictureRecipe recipe = entry.recipe;
        recipe.map.file = file;
        auto& map = maps_[scene_key(recipe.map)];
        if (!map) map = look_at(recipe.map);
        for (const Estimator estimator : entry.estimators) {
            recipe.render.estimator = estimator;
            // An estimator that draws nothing gives one picture, whatever the lists of samples, sequences and seeds.
            const bool all = draws_samples(estimator);
            for (std::size_t n = 0; n < (all ? entry.samples.size() : 1); ++n) {
                for (std::size_t s = 0; s < (all ? entry.sequences.size() : 1); ++s) {
                    for (std::size_t k = 0; k < (all ? entry.seeds.size() : 1); ++k) {
                        recipe.render.samples = entry.samples[n];
                        recipe.render.sampling.sequence = entry.sequences[s];
                        recipe.render.sampling.seed = entry.seeds[k];
                        add_rotations(entry, recipe, map);
                    }
                }
            }
        }
    }

    void add_rotations(const JobEntry& entry, const PictureRecipe& recipe,
                       const std::shared_ptr<const PlannedMap>& map) {
        for (std::size_t frame = 0; frame < entry.rotations.size(); ++frame) {
            Job job;
            job.recipe = recipe;
            job.recipe.map.rotate_y = entry.rotations[frame];
            job.recipe.render.sampling.rotate_y_deg = entry.rotations[frame];
            job.recipe.render.scale = recipe.map.scale;
            job.map = map;
            add_outputs(entry, frame, job);
            drafts_.push_back({std::move(job), entry.place});
            for (std::size_t o = 0; o < entry.outputs.size(); ++o) {
                claim(drafts_.back().job.outputs[o], drafts_.size() - 1, entry.outputs[o].place);
            }
        }
    }

    void add_outputs(const JobEntry& entry, std::size_t frame, Job& job) {
        PatternValues values = values_of(job.recipe);
        values.frame = frame;
        job.outputs.reserve(entry.outputs.size());
        for (const auto& [pattern, place] : entry.outputs) {
            job.outputs.push_back(from_folder(output_folder_, pattern.expand(values)));
            if (const std::size_t bytes = job.outputs.back().size(); bytes > LONGEST_NAME) {
                refuse(place, fmt::format("output: a name has {} bytes with its folder; {} are the most", bytes,
                                          LONGEST_NAME));
            }
            name_bytes_ += job.outputs.back().size();
        }
        name_bytes_ += job.recipe.map.file.size();
        if (name_bytes_ > MOST_NAME_BYTES) {
            refuse(entry.place, fmt::format("the names of maps and outputs up to this job have {} bytes; {} are the "
                                            "most of one batch; split the file or shorten them",
                                            name_bytes_, MOST_NAME_BYTES));
        }
    }

    /// All but the frame.
    static PatternValues values_of(const PictureRecipe& recipe) {
        const fs::path map(recipe.map.file);
        const RenderOptions& render = recipe.render;
        PatternValues values;
        values.map = map.stem().string();
        values.folder = folder_name(map);
        values.rotation = recipe.map.rotate_y;
        values.estimator = estimator_name(render.estimator);
        values.size = render.size;
        if (draws_samples(render.estimator)) {
            values.samples = render.samples;
            values.sequence = sequence_name(render.sampling.sequence);
            values.seed = render.sampling.seed;
        }
        return values;
    }

    /// The name of the folder that a map lies in, whatever part of its path was written; "." for the root.
    static std::string folder_name(const fs::path& map) {
        std::error_code error;
        const std::string name = fs::absolute(map, error).lexically_normal().parent_path().filename().string();
        return name.empty() ? "." : name;
    }

    /// Whose output a file is; two jobs with the same one are a mistake.
    void claim(const std::string& output, std::size_t draft, const Place& place) {
        const auto identity = identity_of(output);
        if (!identity) return;
        const auto [found, fresh] = owners_.try_emplace(*identity, draft);
        if (fresh) return;
        const PatternValues a = values_of(drafts_[found->second].job.recipe);
        const PatternValues b = values_of(drafts_[draft].job.recipe);
        const std::string field = differing_field(a, b, found->second == draft);
        mistake(place, fmt::format("two {} would be written to {}{}", found->second == draft ? "outputs" : "jobs",
                                   shortened(output), field));
    }

    /// What would tell two outputs apart.
    static std::string differing_field(const PatternValues& a, const PatternValues& b, bool same_job) {
        if (same_job) return "; give each another name";
        const char* field = nullptr;
        if (a.folder != b.folder) field = "folder";
        if (a.map != b.map) field = "map";
        if (a.size != b.size) field = "size";
        if (a.seed != b.seed) field = "seed";
        if (a.sequence != b.sequence) field = "sequence";
        if (a.estimator != b.estimator) field = "estimator";
        if (a.samples != b.samples) field = "samples";
        if (a.rotation != b.rotation) field = "rotation";
        return field != nullptr ? fmt::format("; put {{{}}} into the name", field)
                                : "; give one of the jobs another name, or take it out";
    }

    /// As file_identity; for files that do not exist yet, which are most, it looks at each folder once.
    std::optional<FileIdentity> identity_of(const fs::path& path) {
        std::error_code error;
        if (fs::symlink_status(path, error).type() != fs::file_type::not_found) return file_identity(path);
        const auto [found, fresh] = folders_.try_emplace(path.parent_path().string());
        if (fresh) found->second = folder_identity(path.parent_path());
        std::optional<FileIdentity> identity = found->second;
        if (identity) identity->name = (fs::path(identity->name) / path.filename()).string();
        return identity;
    }

    /// Notes a file that no picture may replace.
    void keep(const fs::path& file, const char* what) {
        if (const auto identity = file_identity(file)) kept_.try_emplace(*identity, file.string(), what);
    }

    void check_files_are_kept() {
        for (const auto& [identity, file] : kept_) {
            const auto owner = owners_.find(identity);
            if (owner == owners_.end()) continue;
            mistake(drafts_[owner->second].place,
                    fmt::format("{} would be replaced by a picture, and it is {}", file.first, file.second));
        }
    }

    static std::shared_ptr<const PlannedMap> look_at(const MapOptions& options) {
        auto map = std::make_shared<PlannedMap>();
        map->file = options.file;
        try {
            map->stamp = file_stamp(options.file);
            std::tie(map->width, map->height) = read_image_size(options.file, read_options_of(options));
        } catch (const Error&) {
            // Its jobs say what is wrong with it when their turn comes; the others go on.
        }
        return map;
    }

    /// In order of their maps' first jobs, and as written among those of one map.
    std::vector<Job> sorted_jobs() {
        std::map<const PlannedMap*, std::size_t> order;
        std::vector<std::pair<std::size_t, std::size_t>> by_scene;
        for (std::size_t i = 0; i < drafts_.size(); ++i) {
            by_scene.emplace_back(order.try_emplace(drafts_[i].job.map.get(), order.size()).first->second, i);
        }
        std::sort(by_scene.begin(), by_scene.end());
        std::vector<Job> jobs;
        jobs.reserve(drafts_.size());
        for (const auto& [scene, draft] : by_scene) {
            jobs.push_back(std::move(drafts_[draft].job));
            jobs.back().index = jobs.size() - 1;
        }
        return jobs;
    }

    static void add_costs(std::vector<Job>& jobs) {
        for (std::size_t i = 0; i < jobs.size(); ++i) {
            Job& job = jobs[i];
            const std::size_t width = job.map->width != 0 ? job.map->width : UNREADABLE_WIDTH;
            const std::size_t height = job.map->height != 0 ? job.map->height : UNREADABLE_HEIGHT;
            const bool first = i == 0 || !same_scene(jobs[i - 1], job);
            job.cost_ns = picture_cost_ns(job.recipe.render, width, height, job.outputs.size()) +
                          (first ? map_cost_ns(width, height) : 0);
            job.memory_bytes = scene_bytes(width, height) + estimator_bytes(job.recipe.render, width * height) +
                               picture_bytes(job.recipe.render.size);
        }
    }

    /// Independent of where the files lie: shards on several machines may mount them elsewhere.
    static std::string digest_of_plan(const std::vector<Job>& jobs) {
        std::string all;
        for (const Job& job : jobs) {
            const MapOptions& m = job.recipe.map;
            const RenderOptions& r = job.recipe.render;
            all += json_text(
                nlohmann::json({fs::path(m.file).filename().string(), describe_reading(m), m.rotate_y, m.scale,
                                estimator_name(r.estimator), r.samples, r.size, r.albedo,
                                sequence_name(r.sampling.sequence), texel_place_name(r.sampling.place), r.sampling.seed,
                                r.sampling.control_degree, r.harmonic.degree, r.harmonic.lights,
                                job.recipe.tone.exposure, job.recipe.tone.gamma, job.outputs.size(), job.cost_ns}),
                -1);
            for (const auto& output : job.outputs) all += fs::path(output).filename().string() + "\n";
        }
        return digest_of(all);
    }

    struct Draft {
        Job job;
        Place place;
    };

    const JobFile& jobs_;
    fs::path folder_;
    fs::path output_folder_;
    Mistakes mistakes_;
    MapGlob glob_;
    PictureCount pictures_;
    std::size_t name_bytes_ = 0;
    std::deque<Draft> drafts_;  ///< not moved as they grow, which would take their memory twice
    std::map<std::string, std::shared_ptr<const PlannedMap>> maps_;
    std::map<FileIdentity, std::size_t> owners_;
    std::map<FileIdentity, std::pair<std::string, const char*>> kept_;
    std::map<std::string, std::optional<FileIdentity>> folders_;
};

std::size_t count_in(std::string_view text) {
    std::size_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size() ? value : 0;
}

}  // namespace

FileStamp file_stamp(const fs::path& file) {
    struct stat status {};
    if (::stat(file.c_str(), &status) != 0) {
        throw InputError(fmt::format("{}: {}; check the path", file.string(),
                                     errno == ENOENT ? "no such file" : std::generic_category().message(errno)));
    }
    constexpr std::int64_t BILLION = 1000000000;
    return {static_cast<std::uintmax_t>(status.st_size), status.st_mtim.tv_sec * BILLION + status.st_mtim.tv_nsec,
            status.st_ino};
}

std::uint64_t Plan::cost_ns() const {
    return std::accumulate(jobs.begin(), jobs.end(), std::uint64_t{0},
                           [](std::uint64_t sum, const Job& job) { return sum + job.cost_ns; });
}

bool same_scene(const Job& a, const Job& b) { return a.map == b.map; }

Plan make_plan(const JobFile& jobs, const fs::path& output_folder, std::span<const fs::path> reports) {
    return Planner(jobs, output_folder, reports).plan();
}

Shard shard_by_name(const std::string& name) {
    const std::size_t slash = std::min(name.find('/'), name.size());
    const Shard shard{count_in(name.substr(0, slash)), count_in(name.substr(std::min(slash + 1, name.size())))};
    if (shard.number == 0 || shard.count == 0 || shard.number > shard.count) {
        throw UsageError(fmt::format("--shard {}: not a part of a whole, such as 1/4 to 4/4", name));
    }
    if (shard.count > MOST_PICTURES) {
        throw UsageError(
            fmt::format("--shard {}: {} parts are the most, as many as pictures of one batch", name, MOST_PICTURES));
    }
    return shard;
}

std::string shard_name(const Shard& shard) { return fmt::format("{}/{}", shard.number, shard.count); }

std::span<const Job> jobs_of_shard(const Plan& plan, const Shard& shard) {
    // A job belongs to the shard in whose share of the cost its middle lies; middles follow one another as jobs do.
    const auto total = static_cast<double>(plan.cost_ns());
    std::size_t first = 0;
    std::size_t count = 0;
    std::uint64_t before = 0;
    for (const Job& job : plan.jobs) {
        const double middle = static_cast<double>(before) + static_cast<double>(job.cost_ns) / 2;
        const auto place = static_cast<std::size_t>(middle / total * static_cast<double>(shard.count));
        const std::size_t number = std::min(place, shard.count - 1) + 1;
        if (number < shard.number) ++first;
        if (number == shard.number) ++count;
        before += job.cost_ns;
    }
    return std::span(plan.jobs).subspan(first, count);
}

}  // namespace clerestory
