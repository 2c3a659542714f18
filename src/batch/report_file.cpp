#include "batch/report_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <istream>
#include <map>
#include <streambuf>
#include <string_view>
#include <utility>

#include "base/bounded_file.hpp"
#include "batch/batch_limits.hpp"
#include "error.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using namespace batch_limits;

/// Of a report without its jobs: a number for each shard at most, and a few dozen beside.
constexpr std::size_t MOST_HEAD_VALUES = MOST_PICTURES + 1000;
constexpr std::size_t MOST_HEAD_LISTS = 100;

/// Of a string: a path whose bytes are all written as escapes of six, and words beside it.
constexpr std::size_t LONGEST_TEXT = 8 * LONGEST_NAME;

/// Levels of a report: its own keys stand at 1, its jobs at 2.
constexpr int KEY_LEVEL = 1;
constexpr int JOB_LEVEL = 2;

bool is_whole(const json& value) { return value.is_number_unsigned(); }
bool is_seconds(const json& value) {
    return value.is_number() && std::isfinite(value.get<double>()) && value.get<double>() >= 0;
}
bool is_name(const json& value) {
    if (!value.is_string()) return false;
    const auto& name = value.get_ref<const std::string&>();
    return !name.empty() && name.size() <= LONGEST_NAME && name.find('\0') == std::string::npos;
}
bool is_text(const json& value) { return value.is_string(); }
bool is_number(const json& value) { return value.is_number(); }
bool is_status(const json& value) { return value.is_string() && rank_of(value.get<std::string>()) >= 0; }
bool are_names(const json& value) {
    return value.is_array() && value.size() <= MOST_OUTPUTS && std::all_of(value.begin(), value.end(), is_name);
}
bool are_seconds(const json& value) { return value.is_object() && std::all_of(value.begin(), value.end(), is_seconds); }

/// What of a job is not as `batch` writes it; empty where all is.
std::string wrong_key_of(const json& job) {
    static const std::map<std::string, bool (*)(const json&)> rules = {
        {"index", is_whole},     {"status", is_status}, {"outputs", are_names}, {"map", is_name},
        {"estimator", is_text},  {"sequence", is_text}, {"error", is_text},     {"rotate_y", is_number},
        {"size", is_whole},      {"samples", is_whole}, {"seed", is_whole},     {"exit_code", is_whole},
        {"seconds", are_seconds}};
    for (const char* needed : {"index", "status", "outputs"}) {
        if (!job.contains(needed)) return needed;
    }
    for (const auto& [key, value] : job.items()) {
        const auto rule = rules.find(key);
        if (rule != rules.end() && !rule->second(value)) return key;
    }
    return {};
}

/// A report's text, a block at a time: the parser sees no more of it than a report may have, and no longer string.
class ReportText : public std::streambuf {
  public:
    explicit ReportText(const fs::path& file) : file_(file), in_(open_input(file, NOUN)) {}

  protected:
    int_type underflow() override {
        in_.read(block_.data(), static_cast<std::streamsize>(block_.size()));
        const auto bytes = static_cast<std::size_t>(in_.gcount());
        if (in_.bad()) throw InputError(fmt::format("{}: cannot be read", file_.string()));
        if (bytes == 0) return traits_type::eof();
        all_bytes_ += bytes;
        if (all_bytes_ > MOST_REPORT_BYTES) refuse_size(file_, MOST_REPORT_BYTES, NOUN);
        check_strings({block_.data(), bytes});
        setg(block_.data(), block_.data(), block_.data() + bytes);
        return traits_type::to_int_type(block_[0]);
    }

  private:
    static constexpr const char* NOUN = "a report";

    void check_strings(std::string_view text) {
        for (const char c : text) {
            const bool quote = c == '"' && !escaped_;
            escaped_ = in_string_ && c == '\\' && !escaped_;
            if (quote) in_string_ = !in_string_;
            string_bytes_ = in_string_ ? string_bytes_ + 1 : 0;
            if (string_bytes_ <= LONGEST_TEXT) continue;
            throw InputError(
                fmt::format("{}: is no report of `clerestory batch`: a string in it has more than {} bytes",
                            file_.string(), LONGEST_TEXT));
        }
    }

    const fs::path& file_;
    std::ifstream in_;
    std::array<char, std::size_t{1} << 16> block_{};
    std::size_t all_bytes_ = 0;
    std::size_t string_bytes_ = 0;
    bool in_string_ = false;
    bool escaped_ = false;
};

class ReportReader {
  public:
    ReportReader(const fs::path& file, const std::function<void(std::size_t, json)>& each) : file_(file), each_(each) {}

    ReportHead read() {
        ReportText text(file_);
        std::istream in(&text);
        try {
            const json report = json::parse(
                in, [this](int level, json::parse_event_t event, json& value) { return keep(level, event, value); });
            return head_of_report(report);
        } catch (const json::exception&) {
            refuse_form();
        }
    }

  private:
    [[noreturn]] void refuse_form() const {
        throw InputError(fmt::format("{}: is no report of a finished `clerestory batch`", file_.string()));
    }
    [[noreturn]] void refuse(const std::string& what) const {
        throw InputError(fmt::format("{}: is no report of `clerestory batch`: {}", file_.string(), what));
    }
    void bound(const char* what, std::size_t count, std::size_t most) const {
        if (count > most) refuse(fmt::format("it has {} {}; {} are the most", count, what, most));
    }

    /// Asked at every bracket, key and value of the text: false leaves a job, which `each` has got, out of the whole.
    bool keep(int level, json::parse_event_t event, json& value) {
        bound("levels", static_cast<std::size_t>(level), DEEPEST_REPORT);
        if (event == json::parse_event_t::key) {
            if (level == KEY_LEVEL) in_jobs_ = value.get_ref<const std::string&>() == "jobs";
            return true;
        }
        const bool whole_job = in_jobs_ && level == JOB_LEVEL && event == json::parse_event_t::object_end;
        if (whole_job) {
            take(value);
            return false;
        }
        count(level, event);
        return true;
    }

    void count(int level, json::parse_event_t event) {
        const bool begins = event == json::parse_event_t::object_start || event == json::parse_event_t::array_start;
        if (in_jobs_ && level == JOB_LEVEL && event == json::parse_event_t::object_start) {
            job_values_ = 0;
        } else if (in_jobs_ && level > JOB_LEVEL) {
            bound("values of a job", ++job_values_, 2 * MOST_JOB_VALUES);  // lists count at both ends
        } else {
            bound("values beside those of its jobs", ++head_values_, MOST_HEAD_VALUES);
            // The parser looks through all that a list holds at the end of each list within it.
            if (begins) bound("lists beside those of its jobs", ++head_lists_, MOST_HEAD_LISTS);
        }
    }

    void take(json& job) {
        bound("jobs", ++jobs_, MOST_PICTURES);
        const std::string wrong = wrong_key_of(job);
        if (!wrong.empty()) refuse(fmt::format("job entry {}: its \"{}\" is missing or wrong", jobs_, wrong));
        const auto index = job["index"].get<std::size_t>();
        largest_index_ = std::max(largest_index_, index);
        each_(index, std::move(job));
    }

    ReportHead head_of_report(const json& report) const {
        ReportHead head;
        head.report = file_;
        const json& job_file = report.at("file");
        head.file = is_name(job_file) ? job_file.get<std::string>() : std::string();
        if (head.file.empty()) refuse("its \"file\" is no file name");
        head.version = report.at("version").get<std::string>();
        head.plan = report.at("plan").get<std::string>();
        head.plan_jobs = whole(report.at("plan_jobs"), "plan_jobs", MOST_PICTURES);
        head.shards = whole(report.at("shards"), "shards", MOST_PICTURES);
        head.present = shards_of(report, head.shards);
        const json& seconds = report.at("seconds").at("total");
        if (!is_seconds(seconds)) refuse("its seconds are no time");
        head.seconds = seconds.get<double>();
        if (!report.at("jobs").is_array() || !report.at("jobs").empty()) refuse("its jobs are no list of jobs");
        if (jobs_ > 0 && largest_index_ >= head.plan_jobs) {
            refuse(fmt::format("it tells of job {}, and the batch has {}", largest_index_, head.plan_jobs));
        }
        return head;
    }

    std::size_t whole(const json& value, const char* key, std::size_t most) const {
        if (!is_whole(value)) refuse(fmt::format("its \"{}\" is no whole number", key));
        const auto number = value.get<std::size_t>();
        if (number > most) {
            refuse(fmt::format("it claims {} {}; {} are the most of one batch", number, key, most));
        }
        return number;
    }

    std::set<std::size_t> shards_of(const json& report, std::size_t shards) const {
        std::set<std::size_t> present;
        const auto add = [&](const json& shard) {
            const std::size_t number = whole(shard, "shard", shards);
            if (number == 0) refuse("shards count from 1");
            present.insert(number);
        };
        if (report.contains("shards_present")) {
            if (!report["shards_present"].is_array()) refuse("its \"shards_present\" is no list");
            for (const json& shard : report["shards_present"]) add(shard);
        } else {
            add(report.at("shard"));
        }
        return present;
    }

    const fs::path& file_;
    const std::function<void(std::size_t, json)>& each_;
    bool in_jobs_ = false;
    std::size_t jobs_ = 0;
    std::size_t job_values_ = 0;
    std::size_t head_values_ = 0;
    std::size_t head_lists_ = 0;
    std::size_t largest_index_ = 0;
};

}  // namespace

ReportHead read_report(const fs::path& file, const std::function<void(std::size_t, json)>& each) {
    return ReportReader(file, each).read();
}

void check_same_plan(const ReportHead& report, const ReportHead& first) {
    if (report.plan == first.plan && report.plan_jobs == first.plan_jobs && report.shards == first.shards) return;
    throw InputError(
        fmt::format("{}: is of another batch than {} (other jobs, maps or number of shards); merge "
                    "reports of one batch",
                    report.report.string(), first.report.string()));
}

int rank_of(const std::string& status) {
    if (status == "done" || status == "skipped") return 2;
    if (status == "failed") return 1;
    return status == "not run" || status == "lost" ? 0 : -1;
}

}  // namespace clerestory
