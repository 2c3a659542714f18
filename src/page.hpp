#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace clerestory {

/// HTML made of a report, so that no number of the page is written twice. A number carries its place in the report as
/// data-key (a JSON pointer) and, where it is shown in other units, data-factor.
class PageNumbers {
  public:
    /// The report must outlive it.
    explicit PageNumbers(const nlohmann::json& report) : report_(report) {}

    /// Three significant digits of the number at `key`, times `factor`; an em dash where there is none.
    [[nodiscard]] std::string number(const std::string& key, double factor = 1, std::string_view unit = "") const;
    [[nodiscard]] std::string percent(const std::string& key) const { return number(key, 100, "%"); }
    /// With its sign.
    [[nodiscard]] std::string signed_percent(const std::string& key) const;
    /// Seconds or milliseconds, whichever reads better.
    [[nodiscard]] std::string seconds(const std::string& key) const;
    /// All digits of a whole number, or so many decimals.
    [[nodiscard]] std::string whole(const std::string& key) const;
    [[nodiscard]] std::string fixed(const std::string& key, int decimals, std::string_view unit = "") const;
    /// A value and its error, with two digits of the error.
    [[nodiscard]] std::string with_error(const std::string& key, const std::string& error_key) const;
    /// Text as it stands in the report.
    [[nodiscard]] std::string text(const std::string& key) const;

  private:
    const nlohmann::json& report_;
};

/// Decimals that show two digits of an error.
int decimals_of_error(double error);

/// A picture of a figure.
struct Shown {
    std::string picture;    ///< SVG text, or the bytes of a PNG
    std::string alt = {};   ///< of a PNG: what it shows, for readers that cannot see
    std::string note = {};  ///< a line below it, HTML
};

/// One figure beside its caption, its numbers and the command that makes it.
struct FigureBlock {
    std::string id;       ///< the block's own is about_ID: a plot has its name as id
    std::string title;    ///< HTML
    std::string caption;  ///< HTML
    std::vector<Shown> pictures;
    std::vector<std::string> commands;                         ///< as typed
    std::vector<std::pair<std::string, std::string>> numbers;  ///< name and value, HTML
    std::string shape = {};  ///< "wide": the picture takes the page's whole width; "pair": two square ones side by
                             ///< side; "sphere": it is square
};
std::string figure_html(const FigureBlock& figure);

/// A table that scrolls where the page is narrower; `head` and `rows` are HTML. Columns from the second on are numbers.
std::string table_html(const std::string& caption, const std::vector<std::string>& head,
                       const std::vector<std::vector<std::string>>& rows);

/// A whole page: one file that needs no other, for light and dark screens, phones and paper.
std::string page_html(const std::string& title, const std::string& body);

}  // namespace clerestory
