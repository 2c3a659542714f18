#pragma once

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace clerestory {

/// Fills HTML with a report's values, so that no number of a page is written twice. Fields stand in double braces, each
/// a word that says how to show what follows, which is a JSON pointer:
///   {{number KEY}}           three significant digits; an em dash where there is none
///   {{percent KEY}}          the same in percent; {{signed_percent KEY}} with its sign
///   {{seconds KEY}}          seconds or milliseconds, whichever reads better
///   {{whole KEY}}            all digits
///   {{fixed KEY N [UNIT]}}   N decimals
///   {{with_error KEY ERROR}} a value and its error, with two digits of the error
///   {{text KEY}}, {{count KEY}}
/// and blocks that end with {{end}}:
///   {{each KEY}}             once for every element; $ within is the element's pointer
///   {{if KEY}}               where the value is true, or holds anything
/// A number carries its place in the report as data-key and, where it is shown in other units, data-factor.
class PageTemplate {
  public:
    using Words = std::vector<std::string>;  ///< of a field, its own name first
    using Field = std::function<std::string(const Words&)>;
    using Block = std::function<std::string(const Words&, const std::string& body)>;

    /// The report must outlive it.
    explicit PageTemplate(const nlohmann::json& report);

    void add_field(const std::string& name, Field field) { fields_[name] = std::move(field); }
    void add_block(const std::string& name, Block block) { blocks_[name] = std::move(block); }

    /// Throws std::logic_error where the text has a field that nobody added, or a block without its end.
    [[nodiscard]] std::string fill(std::string_view text) const;
    /// The same with $ for a pointer.
    [[nodiscard]] std::string fill_at(std::string_view text, const std::string& pointer) const;

  private:
    const nlohmann::json& report_;
    std::map<std::string, Field> fields_;
    std::map<std::string, Block> blocks_;
};

/// Decimals that show two digits of an error.
int decimals_of_error(double error);

/// A picture of a figure.
struct Shown {
    std::string picture;    ///< SVG text, or the bytes of a PNG
    std::string alt = {};   ///< of a PNG: what it shows, for readers that cannot see
    std::string note = {};  ///< a line below it, HTML
};

/// One figure beside its caption and the commands that make it.
struct FigureBlock {
    std::string id;     ///< the block's own is about_ID: a plot has its name as id
    std::string shape;  ///< "plain"; "wide": the picture takes the page's whole width; "pair": two square ones side by
                        ///< side; "sphere": it is square
    std::string caption;  ///< HTML
    std::vector<Shown> pictures;
    std::vector<std::string> commands;  ///< as typed
};
std::string figure_html(const FigureBlock& figure);

/// A whole page: one file that needs no other, for light and dark screens, phones and paper.
std::string page_html(const std::string& title, const std::string& body);

/// A file of the pages' own, such as "page.css", which travels within the program. Throws std::out_of_range where there
/// is none of this name.
const std::string& page_text(std::string_view name);

}  // namespace clerestory
