// The house's arrows point down: who may include whom stands in ARCHITECTURE.md, and the sources keep to it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;

/// The folders that each folder of src/ may use.
using Layers = std::map<std::string, std::set<std::string>>;

std::vector<std::string> lines_of(const fs::path& file) {
    std::ifstream in(file);
    std::vector<std::string> lines;
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

std::vector<std::string> names_in_backticks(const std::string& text) {
    static const std::regex name("`([a-z]+)/`");
    std::vector<std::string> names;
    for (std::sregex_iterator at(text.begin(), text.end(), name), end; at != end; ++at) names.push_back((*at)[1]);
    return names;
}

/// Rows "| `folder/` | what it holds | `may/` `use/` |" of ARCHITECTURE.md; "all above" is every folder of the rows
/// before that is no application.
Layers layers() {
    Layers layers;
    std::set<std::string> above;
    for (const std::string& line : lines_of(fs::path(CLERESTORY_SOURCE_DIR) / "ARCHITECTURE.md")) {
        std::vector<std::string> cells;
        std::istringstream row(line);
        for (std::string cell; std::getline(row, cell, '|');) cells.push_back(cell);
        if (cells.size() != 4 || !std::regex_match(cells[1], std::regex(R"( (`[a-z]+/` ?)+)"))) continue;
        const bool all_above = cells[3].find("all above") != std::string::npos;
        const auto named = names_in_backticks(cells[3]);
        std::set<std::string> use(named.begin(), named.end());
        if (all_above) use.insert(above.begin(), above.end());
        const auto folders = names_in_backticks(cells[1]);
        for (const auto& folder : folders) layers[folder] = use;
        if (folders.size() == 1) above.insert(folders[0]);
    }
    return layers;
}

/// Paths of all sources below src/, and the folders of src/ that each includes from.
std::map<fs::path, std::set<std::string>> includes() {
    static const std::regex include(R"rx(#include "([a-z]+)/.*)rx");
    const fs::path source = fs::path(CLERESTORY_SOURCE_DIR) / "src";
    std::map<fs::path, std::set<std::string>> found;
    for (const auto& entry : fs::recursive_directory_iterator(source)) {
        if (!entry.is_regular_file()) continue;
        auto& folders = found[entry.path().lexically_relative(source)];
        for (const std::string& line : lines_of(entry.path())) {
            std::smatch match;
            if (std::regex_match(line, match, include) && match[1] != "clerestory") folders.insert(match[1]);
        }
    }
    return found;
}

TEST(Layers, SourcesIncludeOnlyWhatTheirFolderMayUse) {
    const Layers allowed = layers();
    ASSERT_GT(allowed.size(), 10U) << "the table of ARCHITECTURE.md was not found";
    for (const auto& [file, folders] : includes()) {
        const std::string own = file.begin()->string();
        if (own == "main.cpp") continue;
        ASSERT_TRUE(allowed.contains(own)) << own << "/ is not in the table of ARCHITECTURE.md";
        for (const auto& folder : folders) {
            EXPECT_TRUE(folder == own || allowed.at(own).contains(folder)) << file << " includes from " << folder;
        }
    }
}

TEST(Layers, NothingLiesBesideTheFoldersButMain) {
    std::vector<std::string> files;
    for (const auto& entry : fs::directory_iterator(fs::path(CLERESTORY_SOURCE_DIR) / "src")) {
        if (entry.is_regular_file()) files.push_back(entry.path().filename().string());
    }
    EXPECT_THAT(files, testing::ElementsAre("main.cpp"));
}

TEST(Layers, NoArrowClosesACircle) {
    Layers left = layers();
    while (!left.empty()) {
        const auto lowest = std::find_if(left.begin(), left.end(), [&](const auto& layer) {
            return std::none_of(layer.second.begin(), layer.second.end(),
                                [&](const auto& used) { return used != layer.first && left.contains(used); });
        });
        ASSERT_NE(lowest, left.end()) << left.begin()->first << "/ is part of a circle";
        left.erase(lowest);
    }
}

TEST(Layers, EveryAllowedArrowIsUsed) {
    std::map<std::string, std::set<std::string>> used;
    for (const auto& [file, folders] : includes()) used[file.begin()->string()].insert(folders.begin(), folders.end());
    for (const std::string& line : lines_of(fs::path(CLERESTORY_SOURCE_DIR) / "ARCHITECTURE.md")) {
        std::smatch row;
        if (!std::regex_match(line, row, std::regex(R"(\| `([a-z]+)/` \| [^|]* \| ([^|]*) \|)"))) continue;
        for (const auto& folder : names_in_backticks(row[2])) {
            EXPECT_TRUE(used[row[1]].contains(folder)) << row[1] << "/ may use " << folder << "/ and does not";
        }
    }
}

}  // namespace
}  // namespace clerestory::test
