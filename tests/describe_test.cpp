// Manual pages and completions say what --help says, and work in the programs that read them.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "run_program.hpp"

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;

const fs::path PAGES = fs::path(CLERESTORY_DESCRIBED) / "man1";
const fs::path COMPLETIONS = fs::path(CLERESTORY_DESCRIBED) / "completions";

/// Everything of `text` that the first group of `pattern` matches.
std::set<std::string> all_matches(const std::string& text, const std::string& pattern) {
    const std::regex regex(pattern);
    std::set<std::string> found;
    for (std::sregex_iterator at(text.begin(), text.end(), regex), end; at != end; ++at) found.insert((*at)[1]);
    return found;
}

/// Names of commands, from the program's own help.
std::set<std::string> commands() {
    const std::string help = run_program({"--help"}).out;
    return all_matches(help.substr(help.find("Subcommands:")), "\n  ([a-z]+) ");
}

/// Long and short flags of a command, from its help: the names that begin a line.
std::set<std::string> flags_of(const std::string& command) {
    const std::string help = run_program({command, "--help"}).out;
    auto flags = all_matches(help, "\n  (--[a-z0-9-]+)");
    flags.merge(all_matches(help, "\n  (-[a-z]),--"));
    flags.merge(all_matches(help, "\n  -[a-z],(--[a-z0-9-]+)"));
    return flags;
}

/// A page as groff prints it, without warnings, on lines too long to be broken.
std::string printed(const fs::path& page) {
    const ProgramResult result = run_command({"groff", "-man", "-ww", "-Tascii", "-P-c", "-rLL=1000n", page.string()});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "") << page;
    return std::regex_replace(result.out, std::regex(".\b"), "");  // bold is struck over
}

/// What bash offers for the last of `words`.
std::set<std::string> bash_offers(const std::vector<std::string>& words, const fs::path& folder = {}) {
    std::string line;
    for (const auto& word : words) line += "'" + word + "' ";
    const std::string script =
        fmt::format("source '{}'; COMP_WORDS=({}); COMP_CWORD={}; _clerestory; printf '%s\\n' \"${{COMPREPLY[@]}}\"",
                    (COMPLETIONS / "clerestory").string(), line, words.size() - 1);
    const ProgramResult result = run_command({"bash", "--norc", "-c", script}, {.environment = {}, .folder = folder});
    EXPECT_EQ(result.err, "");
    auto offers = all_matches(result.out, "(.+)\n");
    return offers;
}

TEST(Describe, EveryCommandHasAPage) {
    ASSERT_GE(commands().size(), 8U);
    for (const auto& command : commands()) {
        EXPECT_TRUE(fs::exists(PAGES / ("clerestory-" + command + ".1"))) << command;
        EXPECT_THAT(printed(PAGES / "clerestory.1"), testing::HasSubstr("clerestory-" + command + "(1)"));
    }
}

TEST(Describe, EveryFlagOfHelpStandsInThePageAndInTheCompletions) {
    const std::string zsh = read_file(COMPLETIONS / "_clerestory");
    const std::string fish = read_file(COMPLETIONS / "clerestory.fish");
    for (const auto& command : commands()) {
        const std::string page = printed(PAGES / ("clerestory-" + command + ".1"));
        const auto flags = flags_of(command);
        ASSERT_GE(flags.size(), 8U) << command;
        EXPECT_EQ(bash_offers({"clerestory", command, "-"}), flags);
        const auto branch = zsh.find("                " + command + ") _arguments");
        ASSERT_NE(branch, std::string::npos) << command;
        const std::string zsh_branch = zsh.substr(branch, zsh.find(";;", branch) - branch);
        for (const auto& flag : flags) {
            EXPECT_TRUE(std::regex_search(page, std::regex("(^|[ ,])" + flag + "[ ,\n]"))) << command << " " << flag;
            EXPECT_THAT(zsh_branch, testing::HasSubstr(flag + "[")) << command;
            const std::string name = flag.starts_with("--") ? " -l " + flag.substr(2) : " -s " + flag.substr(1);
            EXPECT_TRUE(std::regex_search(
                fish, std::regex(fmt::format("__fish_seen_subcommand_from {}'[^\n]*{} ", command, name))))
                << command << " " << flag;
        }
    }
}

TEST(Describe, APageSaysDefaultsChoicesAndExamples) {
    const std::string page = printed(PAGES / "clerestory-render.1");
    EXPECT_THAT(page, testing::HasSubstr("One of shared, per-pixel, exact, harmonic.  Default: shared."));
    EXPECT_THAT(page, testing::HasSubstr("Range: 0.01 to 100.  Default: 2.2."));
    EXPECT_THAT(page, testing::HasSubstr("clerestory render [OPTIONS] [MAP]"));
    EXPECT_THAT(page, testing::HasSubstr("clerestory render studio.exr -n 8,16,32 --estimator per-pixel"));
    EXPECT_THAT(page, testing::HasSubstr("OpenCL device or kernel."));
    EXPECT_THAT(printed(PAGES / "clerestory-compare.1"), testing::HasSubstr("clerestory compare [OPTIONS] A B"));
}

TEST(Describe, BashCompletesCommandsFlagsValuesAndFiles) {
    EXPECT_EQ(bash_offers({"clerestory", "ren"}), (std::set<std::string>{"render"}));
    EXPECT_EQ(bash_offers({"clerestory", "--ver"}), (std::set<std::string>{"--version"}));
    EXPECT_EQ(bash_offers({"clerestory", ""}), commands());
    EXPECT_EQ(bash_offers({"clerestory", "render", "--est"}), (std::set<std::string>{"--estimator"}));
    EXPECT_EQ(bash_offers({"clerestory", "render", "--estimator", ""}),
              (std::set<std::string>{"shared", "per-pixel", "exact", "harmonic"}));
    EXPECT_EQ(bash_offers({"clerestory", "render", "--estimator", "=", "ex"}), (std::set<std::string>{"exact"}));
    EXPECT_EQ(bash_offers({"clerestory", "render", "--estimator", "="}).size(), 4U);
    EXPECT_TRUE(bash_offers({"clerestory", "render", "--gamma", ""}).empty());
    const TempFolder folder;
    fs::create_directory(folder.path() / "a folder");
    fs::copy_file(PAGES / "clerestory.1", folder.path() / "map of mine.exr");
    EXPECT_EQ(bash_offers({"clerestory", "render", "map"}, folder.path()), (std::set<std::string>{"map of mine.exr"}));
    EXPECT_EQ(bash_offers({"clerestory", "render", "-o", ""}, folder.path()),
              (std::set<std::string>{"a folder", "map of mine.exr"}));
}

TEST(Describe, TheVersionNamesWhatAReportOfAProblemNeeds) {
    const ProgramResult result = run_program({"--version"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out, testing::MatchesRegex("clerestory [0-9.]+\n"
                                                  "commit    ([0-9a-f]{12}(-dirty)?|unknown)\n"
                                                  "compiler  (GNU|Clang) [0-9.]+, .*\n"
                                                  "device    .+ \\(OpenCL .+\\), driver .+\n"));
    // No driver is found: still an answer.
    const TempFolder empty;
    const ProgramResult without =
        run_program({"--version"}, {.environment = {{"OCL_ICD_VENDORS", empty.path().string()}}});
    EXPECT_EQ(without.exit_code, 0);
    EXPECT_THAT(without.out, testing::HasSubstr("\ndevice    none: no OpenCL device on this machine"));
}

}  // namespace
}  // namespace clerestory::test
