#include "describe/man_page.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <sstream>

namespace clerestory::describe {
namespace {

/// Text that roff takes as it stands: no escapes, no line that looks like a request, real minus signs.
std::string roff(const std::string& text) {
    std::string out;
    bool line_start = true;
    for (const char c : text) {
        if (line_start && (c == '.' || c == '\'')) out += "\\&";
        switch (c) {
            case '\\':
                out += "\\e";
                break;
            case '-':
                out += "\\-";
                break;
            case '\'':
                out += "\\(aq";
                break;
            case '`':
                out += "\\(ga";
                break;
            case '^':
                out += "\\(ha";
                break;
            case '~':
                out += "\\(ti";
                break;
            default:
                out += c;
        }
        line_start = c == '\n';
    }
    return out;
}

std::string bold(const std::string& text) { return "\\fB" + roff(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + roff(text) + "\\fR"; }

std::string upper(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return text;
}

class Page {
  public:
    template <class... Args>
    void line(fmt::format_string<Args...> format, Args&&... args) {
        fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
        text_ += '\n';
    }
    void section(const std::string& title) { line(".SH {}", upper(title)); }
    [[nodiscard]] const std::string& text() const noexcept { return text_; }

  private:
    std::string text_;
};

std::string sentence(const std::string& text) { return text.empty() || text.back() == '.' ? text : text + '.'; }

void add_flag(Page& page, const Flag& flag) {
    std::string names;
    for (const auto& name : flag.names) {
        names += (names.empty() ? "" : ", ") + (name.starts_with('-') ? bold(name) : italic(name));
    }
    page.line(".TP");
    page.line("{}{}", names, flag.takes_value() && flag.names[0].starts_with('-') ? " " + italic(flag.value) : "");
    page.line("{}", roff(sentence(flag.description)));
    if (!flag.choices.empty()) {
        std::vector<std::string> choices;
        for (const auto& choice : flag.choices) choices.push_back(bold(choice));
        page.line("One of {}.", fmt::join(choices, ", "));
    }
    if (!flag.range.empty()) page.line("Range: {}.", roff(flag.range));
    if (!flag.preset.empty()) page.line("Default: {}.", roff(flag.preset));
    if (!flag.excludes.empty()) {
        std::vector<std::string> others;
        for (const auto& name : flag.excludes) others.push_back(bold(name));
        page.line("Not together with {}.", fmt::join(others, ", "));
    }
}

/// Groups in the order in which they first occur.
std::vector<std::string> groups_of(const std::vector<Flag>& flags) {
    std::vector<std::string> groups;
    for (const auto& flag : flags) {
        if (std::find(groups.begin(), groups.end(), flag.group) == groups.end()) groups.push_back(flag.group);
    }
    return groups;
}

void add_flags(Page& page, const Command& command) {
    if (!command.positionals.empty()) page.section("Arguments");
    for (const auto& positional : command.positionals) add_flag(page, positional);
    page.section("Options");
    for (const auto& group : groups_of(command.flags)) {
        if (group != "Options") page.line(".SS {}", roff(group));
        for (const auto& flag : command.flags) {
            if (flag.group == group) add_flag(page, flag);
        }
    }
}

/// Lines of the footer that start with `lead`, without it.
std::string footer_line(const Command& command, const std::string& lead) {
    std::istringstream lines(command.footer);
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with(lead)) return line.substr(lead.size());
    }
    return {};
}

/// Indented lines are examples, as they would be typed; other ones are said after them.
void add_examples(Page& page, const Command& command) {
    std::string examples;
    std::string remarks;
    std::istringstream lines(command.footer);
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with("  ")) {
            examples += roff(line.substr(2)) + "\n";
        } else if (!line.empty() && line != "Example:") {
            remarks += roff(line) + "\n";
        }
    }
    if (examples.empty()) return;
    page.section("Examples");
    page.line(".nf\n{}.fi", examples);
    if (!remarks.empty()) page.line(".PP\n{}", remarks.substr(0, remarks.size() - 1));
}

void add_synopsis(Page& page, const Command& program, const Command& command) {
    page.section("Synopsis");
    if (&program == &command) {
        page.line("{} {} [{}]", bold(program.name), italic("COMMAND"), italic("OPTIONS"));
        return;
    }
    std::string line = bold(program.name + " " + command.name) + " [" + italic("OPTIONS") + "]";
    for (const auto& positional : command.positionals) {
        const std::string name = italic(positional.names[0]);
        line += positional.required ? " " + name : " [" + name + "]";
    }
    page.line("{}", line);
}

void add_exit_status(Page& page, const Command& program) {
    page.section("Exit status");
    std::istringstream codes(footer_line(program, "Exit codes: "));
    for (std::string code; std::getline(codes, code, ',');) {
        const std::size_t start = code.find_first_not_of(' ');
        const std::size_t space = code.find(' ', start);
        page.line(".TP\n{}\n{}", bold(code.substr(start, space - start)), roff(sentence(code.substr(space + 1))));
    }
}

void add_see_also(Page& page, const Command& program, const Command& command) {
    std::vector<std::string> pages;
    if (&program != &command) pages.push_back(bold(program.name) + "(1)");
    for (const auto& other : program.commands) {
        if (&other != &command) pages.push_back(bold(page_name(program, other)) + "(1)");
    }
    page.section("See also");
    page.line("{}", fmt::join(pages, ",\n"));
}

}  // namespace

std::string page_name(const Command& program, const Command& command) {
    return &program == &command ? program.name : program.name + "-" + command.name;
}

std::string man_page(const Command& program, const Command& command, const std::string& release) {
    Page page;
    const std::string name = page_name(program, command);
    page.line(".TH {} 1 \"\" \"{}\" \"User Commands\"", upper(name), release);
    page.line(".nh\n.ad l");  // names and flags are looked for as they are typed
    page.section("Name");
    page.line("{} \\- {}", roff(name), roff(command.description));
    add_synopsis(page, program, command);
    page.section("Description");
    page.line("{}", roff(sentence(command.description)));
    if (&program == &command) {
        page.line(".PP\nA map is a latitude\\-longitude HDR image; without one, the bundled map is used.");
        page.line("Data goes to files or standard output, messages to standard error.");
        page.section("Commands");
        for (const auto& other : program.commands) {
            page.line(".TP\n{}\n{}", bold(other.name), roff(sentence(other.description)));
        }
    }
    add_flags(page, command);
    add_examples(page, command);
    add_exit_status(page, program);
    add_see_also(page, program, command);
    return page.text();
}

}  // namespace clerestory::describe
