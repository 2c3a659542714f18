// The commands of README.md and docs/, run as they are written, on stand-in maps.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <sstream>

#include "image_files.hpp"
#include "maps.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;

/// A line of a code block that calls the program.
struct Command {
    std::string document;
    std::string line;  ///< with its comment
};

/// Lines of code blocks, indented by four or fenced, that start with the program's name; not of those that follow a
/// comment that tells why they cannot run here.
std::vector<Command> commands_of(const fs::path& document) {
    std::vector<Command> commands;
    std::istringstream text(read_file(document));
    bool fenced = false;
    bool told_not_to = false;
    for (std::string line; std::getline(text, line);) {
        const bool prose = !fenced && !line.empty() && !line.starts_with("    ") && !line.starts_with("```");
        if (prose) told_not_to = line.starts_with("<!-- not run: ");
        if (line.starts_with("```")) fenced = !fenced;
        const bool indented = line.starts_with("    ");
        if (!fenced && !indented) continue;
        const std::string words = indented ? line.substr(4) : line;
        if (!told_not_to && words.starts_with("clerestory ")) commands.push_back({document.filename().string(), words});
    }
    return commands;
}

std::vector<Command> all_commands() {
    const fs::path root(CLERESTORY_SOURCE_DIR);
    std::vector<fs::path> documents = {root / "README.md"};
    for (const auto& entry : fs::directory_iterator(root / "docs")) {
        if (entry.path().extension() == ".md") documents.push_back(entry.path());
    }
    std::sort(documents.begin(), documents.end());
    std::vector<Command> all;
    for (const auto& document : documents) {
        const auto commands = commands_of(document);
        all.insert(all.end(), commands.begin(), commands.end());
    }
    return all;
}

/// Maps that the documents name: small, colourful and lit from everywhere.
void write_stand_ins(const fs::path& folder) {
    const RadianceMap map = ramp_map(64, 32);
    std::vector<std::vector<float>> planes(3);
    for (std::size_t i = 0; i < map.rgb.size(); ++i) planes[i % 3].push_back(map.rgb[i]);
    ExrLayout layout;
    layout.width = 64;
    layout.height = 32;
    for (const char* name : {"studio.exr", "grace_latlong.exr"}) {
        write_test_exr(folder / name, layout,
                       {{"R", Imf::FLOAT, planes[0]}, {"G", Imf::FLOAT, planes[1]}, {"B", Imf::FLOAT, planes[2]}});
    }
}

/// A job file that the documents name.
void write_job_file(const fs::path& folder) {
    std::ofstream(folder / "turntable.toml") << "[[job]]\nmap = \"studio.exr\"\nsize = 17\nsamples = 16\n"
                                                "rotate_y = [0, 180]\noutput = \"{map}_{rotation:03}.png\"\n";
}

/// What a line may end with: 0, and the code that its comment names ("exit code 1 where ...").
std::vector<int> codes_allowed(const std::string& line) {
    std::vector<int> codes = {0};
    std::smatch found;
    if (std::regex_search(line, found, std::regex("#.*exit code ([0-9])"))) codes.push_back(std::stoi(found[1]));
    return codes;
}

TEST(Documents, EveryCommandRunsAsItIsWritten) {
    const TempFolder folder;
    write_stand_ins(folder.path());
    write_job_file(folder.path());
    const std::string path = fs::path(CLERESTORY_PROGRAM).parent_path().string() + ":" + std::getenv("PATH");
    // Below this the documents were read wrongly, or not found.
    constexpr std::size_t FEWEST = 10;
    const auto commands = all_commands();
    ASSERT_GE(commands.size(), FEWEST);
    for (const Command& command : commands) {
        const std::string script = folder.file("command.sh");
        std::ofstream(script) << "cd '" << folder.path().string() << "' && PATH='" << path << "'\n"
                              << command.line << "\n";
        const int status = std::system(("sh '" + script + "' >'" + script + ".log' 2>&1 </dev/null").c_str());
        ASSERT_TRUE(WIFEXITED(status));
        const auto codes = codes_allowed(command.line);
        EXPECT_EQ(std::count(codes.begin(), codes.end(), WEXITSTATUS(status)), 1)
            << command.document << ": " << command.line << "\nended with " << WEXITSTATUS(status) << "\n"
            << read_file(script + ".log");
    }
}

TEST(Documents, EveryLinkLeadsToAFile) {
    const fs::path root(CLERESTORY_SOURCE_DIR);
    const std::regex link(R"(\]\(([^)#:]+)\))");
    std::size_t links = 0;
    for (const char* document : {"README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "docs/interchange.md"}) {
        const std::string text = read_file(root / document);
        for (std::sregex_iterator at(text.begin(), text.end(), link), end; at != end; ++at, ++links) {
            EXPECT_TRUE(fs::exists((root / document).parent_path() / (*at)[1].str())) << document << ": " << (*at)[1];
        }
    }
    EXPECT_GT(links, 4U);
}

}  // namespace
}  // namespace clerestory::test
