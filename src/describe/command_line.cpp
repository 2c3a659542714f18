#include "describe/command_line.hpp"

#include <algorithm>
#include <sstream>

namespace clerestory::describe {
namespace {

std::vector<std::string> parts_of(const std::string& text, char separator) {
    std::vector<std::string> parts;
    std::istringstream stream(text);
    for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
    return parts;
}

/// CLI11's words for types as manual pages have them.
std::string value_name(const std::string& type) {
    if (type == "TEXT") return "NAME";
    if (type == "UINT" || type == "INT") return "N";
    return type == "FLOAT" ? "X" : type;
}

/// "UINT in [0 - 40]" and "0..40" as "0 to 40".
std::string range_text(std::string limits) {
    if (const auto bracket = limits.find(" in ["); bracket != std::string::npos && limits.ends_with(']')) {
        limits = limits.substr(bracket + 5, limits.size() - bracket - 6);
    }
    for (const std::string separator : {" - ", ".."}) {
        if (const auto at = limits.find(separator); at != std::string::npos) {
            return limits.substr(0, at) + " to " + limits.substr(at + separator.size());
        }
    }
    return limits;
}

/// "TEXT:{a,b}" gives value NAME and choices a, b; "X:0..1" value X and range "0 to 1". Device numbers, P:D, are a
/// value.
void read_type(Flag& flag, const std::string& type) {
    const std::size_t colon = type.find(':', type.starts_with("P:D") ? 3 : 0);
    flag.value = value_name(type.substr(0, colon));
    if (colon == std::string::npos) return;
    const std::string limits = type.substr(colon + 1);
    if (limits.starts_with('{') && limits.ends_with('}')) {
        flag.choices = parts_of(limits.substr(1, limits.size() - 2), ',');
    } else {
        flag.range = range_text(limits);
    }
}

Flag read_flag(const CLI::Option& option) {
    Flag flag;
    for (const auto& name : option.get_snames()) flag.names.push_back("-" + name);
    for (const auto& name : option.get_lnames()) flag.names.push_back("--" + name);
    if (option.get_positional()) flag.names = {option.get_name(true)};
    if (option.get_items_expected_max() != 0) read_type(flag, option.get_type_name());
    flag.preset = option.get_default_str();
    // A vector's preset stands in brackets.
    if (flag.preset.starts_with('[') && flag.preset.ends_with(']')) {
        flag.preset = flag.preset.substr(1, flag.preset.size() - 2);
    }
    flag.description = option.get_description();
    flag.group = option.get_group();
    for (const auto* other : option.get_excludes()) {
        flag.excludes.push_back(other->get_name());
        const auto names = parts_of(flag.excludes.back(), ',');
        flag.excludes.back() = names.back();
    }
    std::sort(flag.excludes.begin(), flag.excludes.end());
    flag.repeats = option.get_expected_max() > 1;
    flag.required = option.get_required();
    return flag;
}

}  // namespace

Command read_command_line(const CLI::App& app) {
    Command command;
    command.name = app.get_name();
    command.description = app.get_description();
    command.footer = app.get_footer();
    for (const CLI::Option* option : app.get_options()) {
        if (option->get_group().empty()) continue;  // hidden
        (option->get_positional() ? command.positionals : command.flags).push_back(read_flag(*option));
    }
    for (const CLI::App* subcommand : app.get_subcommands([](const CLI::App*) { return true; })) {
        if (!subcommand->get_group().empty()) command.commands.push_back(read_command_line(*subcommand));
    }
    return command;
}

}  // namespace clerestory::describe
