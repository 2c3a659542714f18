#include "describe/completion.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <iterator>

namespace clerestory::describe {
namespace {

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
        text.replace(at, from.size(), to);
    }
    return text;
}

/// A word in single quotes, as bash and zsh take it.
std::string quoted(const std::string& text) { return "'" + replaced(text, "'", "'\\''") + "'"; }

/// The same for fish, where a backslash counts within quotes.
std::string fish_quoted(const std::string& text) {
    return "'" + replaced(replaced(text, "\\", "\\\\"), "'", "\\'") + "'";
}

std::string words_of(const std::vector<Command>& commands) {
    std::vector<std::string> names;
    for (const auto& command : commands) names.push_back(command.name);
    return fmt::format("{}", fmt::join(names, " "));
}

std::string names_of(const std::vector<Flag>& flags) {
    std::vector<std::string> names;
    for (const auto& flag : flags) names.insert(names.end(), flag.names.begin(), flag.names.end());
    return fmt::format("{}", fmt::join(names, " "));
}

/// What follows a flag of one command, as a branch of bash's case.
std::string bash_value(const std::string& command, const Flag& flag) {
    std::vector<std::string> patterns;
    for (const auto& name : flag.names) patterns.push_back(fmt::format("{}:{}", command, name));
    std::string action = "return";
    if (!flag.choices.empty()) {
        action = fmt::format("_clerestory_words {}; return", quoted(fmt::format("{}", fmt::join(flag.choices, " "))));
    } else if (flag.takes_file()) {
        action = "_clerestory_files; return";
    }
    return fmt::format("        {}) {} ;;\n", fmt::join(patterns, "|"), action);
}

constexpr const char* BASH_HEAD = R"(# bash completion for clerestory, generated from its command line.

# Completes one of the words $1, also after a comma.
_clerestory_words() {
    local done=
    [[ $cur == *,* ]] && done=${cur%,*},
    COMPREPLY=($(compgen -P "$done" -W "$1" -- "${cur##*,}"))
}

_clerestory_files() {
    local IFS=$'\n'
    compopt -o filenames 2>/dev/null
    COMPREPLY=($(compgen -f -- "$cur"))
}

_clerestory() {
    local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} command= word
    # --flag=value arrives as three words.
    if [[ $cur == = ]]; then
        cur=
    elif [[ $prev == = ]]; then
        prev=${COMP_WORDS[COMP_CWORD-2]}
    fi
    COMPREPLY=()
    for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
        [[ $word != -* ]] && command=$word && break
    done
    case $command:$prev in
)";

constexpr const char* BASH_FOOT = R"(        *) [[ -n $command ]] && _clerestory_files ;;
    esac
}
complete -F _clerestory clerestory
)";

/// Text within a zsh specification, in which brackets and colons have a meaning.
std::string zsh_text(const std::string& text) {
    std::string out = replaced(text, "\\", "\\\\");
    for (const std::string special : {"[", "]", ":"}) out = replaced(out, special, fmt::format("\\{}", special));
    return out;
}

/// One line of _arguments for each name of a flag.
std::string zsh_flag(const Flag& flag) {
    std::string value;
    if (flag.takes_value()) {
        value = fmt::format(":{}:", zsh_text(flag.value));
        if (!flag.choices.empty()) value += fmt::format("({})", fmt::join(flag.choices, " "));
        if (flag.takes_file()) value += "_files";
    }
    std::string lines;
    for (const auto& name : flag.names) {
        lines += fmt::format("                {} \\\n", quoted(fmt::format("{}{}[{}]{}", flag.repeats ? "*" : "", name,
                                                                           zsh_text(flag.description), value)));
    }
    return lines;
}

std::string fish_flag(const std::string& condition, const Flag& flag) {
    std::string line = "complete -c clerestory -n " + fish_quoted(condition);
    for (const auto& name : flag.names) {
        line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
    }
    if (!flag.choices.empty()) {
        line += " -x -a " + fish_quoted(fmt::format("{}", fmt::join(flag.choices, " ")));
    } else if (flag.takes_file()) {
        line += " -r -F";
    } else if (flag.takes_value()) {
        line += " -x";
    }
    return line + " -d " + fish_quoted(flag.description) + "\n";
}

}  // namespace

std::string bash_completion(const Command& program) {
    std::string out = BASH_HEAD;
    for (const auto& command : program.commands) {
        for (const auto& flag : command.flags) {
            if (flag.takes_value()) out += bash_value(command.name, flag);
        }
    }
    out += "    esac\n    case $command:$cur in\n";
    out += fmt::format("        :-*) _clerestory_words {} ;;\n", quoted(names_of(program.flags)));
    out += fmt::format("        :*) _clerestory_words {} ;;\n", quoted(words_of(program.commands)));
    for (const auto& command : program.commands) {
        out += fmt::format("        {}:-*) _clerestory_words {} ;;\n", command.name, quoted(names_of(command.flags)));
    }
    return out + BASH_FOOT;
}

std::string zsh_completion(const Command& program) {
    std::string out = "#compdef clerestory\n# zsh completion for clerestory, generated from its command line.\n\n";
    out += "_clerestory() {\n    local context state state_descr line\n    typeset -A opt_args\n    _arguments -C \\\n";
    for (const auto& flag : program.flags) out += zsh_flag(flag);
    out += "                '1:command:->command' '*::argument:->arguments'\n    case $state in\n        command)\n";
    out += "            local -a commands=(\n";
    for (const auto& command : program.commands) {
        out += fmt::format("                {}\n", quoted(command.name + ":" + zsh_text(command.description)));
    }
    out += "            )\n            _describe command commands ;;\n";
    out += "        arguments)\n            case $words[1] in\n";
    for (const auto& command : program.commands) {
        out += fmt::format("                {}) _arguments -S \\\n", command.name);
        for (const auto& flag : command.flags) out += zsh_flag(flag);
        out += "                '*:file:_files' ;;\n";
    }
    return out + "            esac ;;\n    esac\n}\n\n_clerestory \"$@\"\n";
}

std::string fish_completion(const Command& program) {
    std::string out = "# fish completion for clerestory, generated from its command line.\n";
    const std::string commands = words_of(program.commands);
    const std::string none = "not __fish_seen_subcommand_from " + commands;
    for (const auto& flag : program.flags) out += fish_flag(none, flag);
    for (const auto& command : program.commands) {
        out += fmt::format("complete -c clerestory -f -n {} -a {} -d {}\n", fish_quoted(none), command.name,
                           fish_quoted(command.description));
        for (const auto& flag : command.flags) out += fish_flag("__fish_seen_subcommand_from " + command.name, flag);
    }
    return out;
}

}  // namespace clerestory::describe
