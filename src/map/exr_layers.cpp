#include "map/exr_layers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "base/text_escape.hpp"
#include "map/image_source.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// Names that a message lists before it says how many more there are.
constexpr std::size_t NAMES_LISTED = 8;

std::string lower(std::string_view text) {
    std::string out(text);
    std::transform(out.begin(), out.end(), out.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    return out;
}

/// The part of a channel's name before its last dot.
std::string layer_of(const std::string& channel) {
    const std::size_t dot = channel.rfind('.');
    return dot == std::string::npos ? std::string() : channel.substr(0, dot);
}

/// The part of a name after its last dot.
std::string last_word(const std::string& name) { return name.substr(name.rfind('.') + 1); }

bool is_one_of(const std::string& word, std::span<const std::string_view> words) {
    return std::find(words.begin(), words.end(), word) != words.end();
}

/// Layers that hold the whole picture, by their usual names: Blender's, Nuke's and Arnold's, V-Ray's, RenderMan's.
bool is_beauty(const std::string& name) {
    static constexpr std::array<std::string_view, 4> NAMES = {"combined", "rgba", "beauty", "ci"};
    return is_one_of(lower(last_word(name)), NAMES);
}

/// Layers that hold no light, by their usual names: geometry, mattes and previews. Numbers and signs do not count:
/// CryptoObject00 and world_normal are known as well.
bool holds_no_light(const std::string& name) {
    static constexpr std::array<std::string_view, 17> WORDS = {
        "z",     "n",      "p",      "alpha",   "st",    "uv",       "pos",        "id",           "mask",
        "masks", "motion", "vector", "vectors", "thumb", "objectid", "materialid", "pointposition"};
    static constexpr std::array<std::string_view, 10> ENDINGS = {
        "depth",    "normal",   "normals",      "matte",         "mattes",
        "position", "velocity", "motionvector", "motionvectors", "thumbnail"};
    std::string word = lower(last_word(name));
    std::erase_if(word, [](char c) { return c < 'a' || c > 'z'; });
    if (word.starts_with("crypto") || word.starts_with("ucrypto") || is_one_of(word, WORDS)) return true;
    return std::any_of(ENDINGS.begin(), ENDINGS.end(), [&](std::string_view end) { return word.ends_with(end); });
}

/// A layer of one part.
struct Layer {
    int part = 0;
    std::string name;   ///< as ChosenLayer::layer
    std::string title;  ///< what it is called: its name, or its part's where the part is its only name
    std::vector<std::string> channels;

    /// The channel whose last word is one of `words`; of several the one that the first of them names. "" without.
    [[nodiscard]] std::string find(std::initializer_list<std::string_view> words) const {
        for (const std::string_view word : words) {
            for (const std::string& channel : channels) {
                if (lower(last_word(channel)) == word) return channel;
            }
        }
        return {};
    }
};

std::optional<ChosenLayer> as_rgb(const Layer& layer) {
    const std::array<std::string, 3> found = {layer.find({"r", "red"}), layer.find({"g", "green"}),
                                              layer.find({"b", "blue"})};
    if (std::any_of(found.begin(), found.end(), [](const std::string& name) { return name.empty(); })) return {};
    return ChosenLayer{layer.part, layer.name, LayerKind::rgb, found, layer.find({"a", "alpha"}), {}};
}

std::optional<ChosenLayer> as_chroma(const Layer& layer) {
    const std::array<std::string, 3> found = {layer.find({"y"}), layer.find({"ry"}), layer.find({"by"})};
    if (found[1].empty() || found[2].empty() || found[0].empty()) return {};
    return ChosenLayer{layer.part, layer.name, LayerKind::luminance_chroma, found, layer.find({"a", "alpha"}), {}};
}

/// A lone luminance: beside part of another set (X, Y, Z of a normal; R and G) it is none.
std::optional<ChosenLayer> as_luminance(const Layer& layer) {
    const std::string y = layer.find({"y", "luminance", "grey", "gray"});
    if (y.empty() || !layer.find({"x", "ry", "by", "r", "red", "g", "green", "b", "blue"}).empty()) return {};
    return ChosenLayer{layer.part, layer.name, LayerKind::luminance, {y, y, y}, layer.find({"a", "alpha"}), {}};
}

std::optional<ChosenLayer> as_any(const Layer& layer) {
    if (auto rgb = as_rgb(layer)) return rgb;
    if (auto chroma = as_chroma(layer)) return chroma;
    return as_luminance(layer);
}

std::string listed(std::vector<std::string> names) {
    const std::size_t all = names.size();
    names.resize(std::min(all, NAMES_LISTED));
    std::string text = one_line(fmt::format("{}", fmt::join(names, ", ")));
    if (all > NAMES_LISTED) text += fmt::format(" and {} more", all - NAMES_LISTED);
    return text;
}

class Chooser {
  public:
    Chooser(const fs::path& file, std::span<const ExrPart> parts, const LayerRequest& request)
        : file_(file), parts_(parts), request_(request) {
        check_parts();
        for (std::size_t p = 0; p < parts.size(); ++p) {
            const int part = static_cast<int>(p);
            if (parts[p].flat && (!request.part || *request.part == part)) add_layers(part);
        }
    }

    [[nodiscard]] ChosenLayer choose() const {
        if (!request_.layer.empty()) return choose_named();
        const std::vector<Layer> layers = lighting();
        for (const auto as_kind : {as_rgb, as_chroma, as_luminance}) {
            if (auto chosen = choose_of(layers, as_kind)) return *chosen;
        }
        throw refused(file_, fmt::format("has no R, G, B and no luminance Y that could light, only {}; {}",
                                         listed(all_channels()),
                                         layers_.size() > 1 ? "--layer NAME lights with a layer of your choice"
                                                            : "write the map with R, G and B"));
    }

  private:
    void check_parts() const {
        if (std::none_of(parts_.begin(), parts_.end(), [](const ExrPart& part) { return part.flat; })) {
            throw refused(file_, "holds deep samples only; flatten it to an image first");
        }
        if (!request_.part) return;
        const auto count = static_cast<int>(parts_.size());
        if (*request_.part < 0 || *request_.part >= count) {
            throw refused(file_, count == 1
                                     ? fmt::format("has no part {}, only part 0", *request_.part)
                                     : fmt::format("has no part {}; its parts are 0 to {}", *request_.part, count - 1));
        }
        if (!parts_[static_cast<std::size_t>(*request_.part)].flat) {
            throw refused(file_,
                          fmt::format("part {} holds deep samples; flatten it first, or choose another with --part",
                                      *request_.part));
        }
    }

    void add_layers(int part) {
        const ExrPart& described = parts_[static_cast<std::size_t>(part)];
        const std::size_t first = layers_.size();
        for (const std::string& channel : described.channels) {
            const std::string name = layer_of(channel);
            const auto begin = layers_.begin() + static_cast<std::ptrdiff_t>(first);
            auto known = std::find_if(begin, layers_.end(), [&](const Layer& layer) { return layer.name == name; });
            if (known == layers_.end()) {
                // The only part's name is the file's, and says nothing of a layer.
                const std::string& title = name.empty() && parts_.size() > 1 ? described.name : name;
                known = layers_.insert(known, Layer{part, name, title, {}});
            }
            known->channels.push_back(channel);
        }
    }

    /// The layers that may light unasked. A part that was asked for may be called as it likes.
    [[nodiscard]] std::vector<Layer> lighting() const {
        std::vector<Layer> kept;
        std::copy_if(layers_.begin(), layers_.end(), std::back_inserter(kept), [&](const Layer& layer) {
            return !holds_no_light(layer.title) || (layer.name.empty() && request_.part);
        });
        return kept;
    }

    [[nodiscard]] std::vector<std::string> all_channels() const {
        std::vector<std::string> names;
        for (const Layer& layer : layers_) names.insert(names.end(), layer.channels.begin(), layer.channels.end());
        return names;
    }

    [[nodiscard]] static std::string title_of(const Layer& layer) {
        return layer.title.empty() ? fmt::format("part {}", layer.part) : one_line(layer.title);
    }
    [[nodiscard]] static std::string titles_of(const std::vector<Layer>& layers) {
        std::vector<std::string> titles;
        std::transform(layers.begin(), layers.end(), std::back_inserter(titles), title_of);
        return listed(titles);
    }

    /// The layer of one kind that lights; nothing where none is of that kind.
    template <class AsKind>
    [[nodiscard]] std::optional<ChosenLayer> choose_of(const std::vector<Layer>& layers, AsKind as_kind) const {
        std::vector<Layer> unnamed;
        std::vector<Layer> named;
        for (const Layer& layer : layers) {
            if (as_kind(layer)) (layer.name.empty() ? unnamed : named).push_back(layer);
        }
        if (unnamed.empty() && named.empty()) return {};
        const std::vector<Layer>& able = unnamed.empty() ? named : unnamed;
        std::vector<Layer> beauties;
        std::copy_if(able.begin(), able.end(), std::back_inserter(beauties),
                     [](const Layer& layer) { return is_beauty(layer.title); });
        if (beauties.size() == 1) return as_kind(beauties.front());

        const int part = able.front().part;
        const auto elsewhere = std::find_if(able.begin(), able.end(), [&](const Layer& l) { return l.part != part; });
        const std::vector<Layer> first_part(able.begin(), elsewhere);
        if (first_part.size() > 1) {
            throw refused(file_, fmt::format("several layers could light ({}); choose one with --layer NAME",
                                             titles_of(first_part)));
        }
        std::optional<ChosenLayer> chosen = as_kind(first_part.front());
        std::transform(elsewhere, able.end(), std::back_inserter(chosen->passed_over), title_of);
        return chosen;
    }

    [[nodiscard]] ChosenLayer choose_named() const {
        const std::string wanted = lower(request_.layer);
        std::vector<Layer> found;
        const auto collect = [&](auto matches) {
            if (!found.empty()) return;
            std::copy_if(layers_.begin(), layers_.end(), std::back_inserter(found),
                         [&](const Layer& layer) { return matches(lower(layer.title)); });
        };
        collect([&](const std::string& title) { return title == wanted; });
        collect([&](const std::string& title) { return title.ends_with("." + wanted); });
        if (found.empty()) {
            throw refused(file_, fmt::format("has no layer {}; {}", one_line(request_.layer), what_there_is()));
        }
        const auto other = [&](const Layer& layer) { return lower(layer.title) != lower(found.front().title); };
        if (std::any_of(found.begin(), found.end(), other)) {
            throw refused(file_, fmt::format("{} could be {}; give --layer the whole name", one_line(request_.layer),
                                             titles_of(found)));
        }
        for (const Layer& layer : found) {
            if (auto chosen = as_any(layer)) return *chosen;
        }
        throw refused(file_, fmt::format("layer {} cannot light: it has {} and no R, G, B or Y",
                                         one_line(request_.layer), listed(found.front().channels)));
    }

    [[nodiscard]] std::string what_there_is() const {
        std::vector<Layer> titled;
        std::copy_if(layers_.begin(), layers_.end(), std::back_inserter(titled),
                     [](const Layer& layer) { return !layer.title.empty(); });
        if (titled.empty()) return "its channels belong to none, and --layer is not needed";
        return fmt::format("its layers are {}", titles_of(titled));
    }

    const fs::path& file_;
    std::span<const ExrPart> parts_;
    const LayerRequest& request_;
    std::vector<Layer> layers_;
};

}  // namespace

ChosenLayer choose_layer(const fs::path& file, std::span<const ExrPart> parts, const LayerRequest& request) {
    return Chooser(file, parts, request).choose();
}

}  // namespace clerestory
