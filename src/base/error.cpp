#include "error.hpp"

#include "base/text_escape.hpp"

namespace clerestory {
namespace {

std::string joined(const std::vector<std::string>& lines) {
    std::string all;
    for (const std::string& line : lines) {
        if (!all.empty()) all += '\n';
        all += one_line(line);
    }
    return all;
}

}  // namespace

Error::Error(int exit_code, const std::string& what) : Error(exit_code, std::vector{what}) {}

Error::Error(int exit_code, const std::vector<std::string>& lines)
    : std::runtime_error(joined(lines)), exit_code_(exit_code) {}

}  // namespace clerestory
