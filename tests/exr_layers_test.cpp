#include "map/exr_layers.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "error.hpp"

namespace clerestory {
namespace {

/// What lights, as "part layer: channels", or what the one line of refusal says after the file's name.
std::string choice(const std::vector<ExrPart>& parts, const LayerRequest& request = {}) {
    try {
        const ChosenLayer chosen = choose_layer("map.exr", parts, request);
        return fmt::format("{} {}: {}", chosen.part, chosen.layer, fmt::join(chosen.channels, " "));
    } catch (const InputError& error) {
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
        return error.what();
    }
}

ExrPart part(std::vector<std::string> channels, std::string name = {}) { return {std::move(name), true, channels}; }

std::vector<std::string> layer(const std::string& name, const std::string& letters = "BGR") {
    std::vector<std::string> channels;
    for (const char c : letters) channels.push_back(name + "." + c);
    return channels;
}

std::vector<std::string> together(const std::vector<std::vector<std::string>>& layers) {
    std::vector<std::string> all;
    for (const auto& one : layers) all.insert(all.end(), one.begin(), one.end());
    return all;
}

struct Case {
    std::string name;
    std::vector<ExrPart> parts;
    std::string expected;
};

class ExrLayers : public testing::TestWithParam<Case> {};

TEST_P(ExrLayers, TheOneThatIsThePictureLights) { EXPECT_EQ(choice(GetParam().parts), GetParam().expected); }

INSTANTIATE_TEST_SUITE_P(
    Channels, ExrLayers,
    testing::Values(
        Case{"Plain", {part({"B", "G", "R"})}, "0 : R G B"}, Case{"LowerCase", {part({"b", "g", "r"})}, "0 : r g b"},
        Case{"Words", {part({"BLUE", "Green", "red"})}, "0 : red Green BLUE"},
        Case{"LettersBeforeWords", {part({"B", "Blue", "G", "Green", "R", "Red"})}, "0 : R G B"},
        Case{"WithDepthAndAlpha", {part({"A", "B", "G", "R", "Z"})}, "0 : R G B"},
        Case{"OneLayer", {part(layer("sky"))}, "0 sky: sky.R sky.G sky.B"},
        Case{"LayerOfLowerCase",
             {part(layer("ViewLayer.Combined", "bgr"))},
             "0 ViewLayer.Combined: ViewLayer.Combined.r ViewLayer.Combined.g ViewLayer.Combined.b"},
        Case{"CombinedOfBlender",
             {part(together({layer("View Layer.AO"), layer("View Layer.Combined", "ABGR"),
                             layer("View Layer.Depth", "Z"), layer("View Layer.Normal", "XYZ")}))},
             "0 View Layer.Combined: View Layer.Combined.R View Layer.Combined.G View Layer.Combined.B"},
        Case{"RgbaOfArnold", {part(together({layer("albedo"), layer("RGBA")}))}, "0 RGBA: RGBA.R RGBA.G RGBA.B"},
        Case{"CiOfRenderMan", {part(together({layer("Ci", "bgr"), layer("diffuse", "bgr")}))}, "0 Ci: Ci.r Ci.g Ci.b"},
        Case{"UnnamedBeforeBeauty", {part(together({{"B", "G", "R"}, layer("beauty")}))}, "0 : R G B"},
        Case{"NormalsAreNoLight", {part(together({layer("normals"), layer("sky")}))}, "0 sky: sky.R sky.G sky.B"},
        Case{"CryptomattesAreNoLight",
             {part(together({layer("ViewLayer.CryptoObject00", "abgr"), layer("ViewLayer.Diffuse")}))},
             "0 ViewLayer.Diffuse: ViewLayer.Diffuse.R ViewLayer.Diffuse.G ViewLayer.Diffuse.B"},
        Case{"AMattePaintingIsLight",
             {part(layer("mattepainting"))},
             "0 mattepainting: mattepainting.R mattepainting.G mattepainting.B"},
        Case{"Luminance", {part({"A", "Y"})}, "0 : Y Y Y"}, Case{"Grey", {part({"grey"})}, "0 : grey grey grey"},
        Case{"LuminanceAndDepth", {part({"Y", "Z"})}, "0 : Y Y Y"},
        Case{"Chroma", {part({"BY", "RY", "Y"})}, "0 : Y RY BY"},
        Case{"ChromaOfALayer", {part({"a.BY", "a.RY", "a.Y"})}, "0 a: a.Y a.RY a.BY"},
        Case{"ColourBeforeLuminance", {part(together({{"Y"}, layer("sky")}))}, "0 sky: sky.R sky.G sky.B"}),
    [](const auto& info) { return info.param.name; });

INSTANTIATE_TEST_SUITE_P(
    Parts, ExrLayers,
    testing::Values(
        Case{"DepthFirst", {part({"Z"}, "depth"), part({"B", "G", "R"}, "rgb")}, "1 : R G B"},
        Case{"DepthInColours", {part({"B", "G", "R"}, "depth"), part({"B", "G", "R"}, "sky")}, "1 : R G B"},
        Case{"ThumbnailFirst", {part({"B", "G", "R"}, "thumbnail"), part({"B", "G", "R"}, "main")}, "1 : R G B"},
        Case{"ByNameOfPart", {part({"B", "G", "R"}, "View.AO"), part({"B", "G", "R"}, "View.Combined")}, "1 : R G B"},
        Case{"ElseTheFirst", {part({"B", "G", "R"}, "left"), part({"B", "G", "R"}, "right")}, "0 : R G B"},
        Case{"UnnamedLayerOfALaterPart", {part(layer("sky"), "a"), part({"B", "G", "R"}, "b")}, "1 : R G B"},
        Case{"LuminanceBeforeColour", {part({"Y"}, "a"), part({"B", "G", "R"}, "b")}, "1 : R G B"},
        Case{"AfterDeep", {{"deep", false, {"B", "G", "R"}}, part({"B", "G", "R"}, "flat")}, "1 : R G B"},
        Case{"TheOnlyPartMayBeCalledAnything", {part({"B", "G", "R"}, "depth")}, "0 : R G B"}),
    [](const auto& info) { return info.param.name; });

INSTANTIATE_TEST_SUITE_P(
    Refused, ExrLayers,
    testing::Values(
        Case{"SeveralLayers",
             {part(together({layer("a"), layer("b")}))},
             "map.exr: several layers could light (a, b); choose one with --layer NAME"},
        Case{"TwoBeauties",
             {part(together({layer("A.Combined"), layer("B.Combined")}))},
             "map.exr: several layers could light (A.Combined, B.Combined); choose one with --layer NAME"},
        Case{"DepthAlone",
             {part({"Z"})},
             "map.exr: has no R, G, B and no luminance Y that could light, only Z; write the map with R, G and B"},
        Case{"AlphaAlone",
             {part({"A"})},
             "map.exr: has no R, G, B and no luminance Y that could light, only A; write the map with R, G and B"},
        Case{"RedAndGreen",
             {part({"G", "R"})},
             "map.exr: has no R, G, B and no luminance Y that could light, only G, R; write the map with R, G and B"},
        Case{
            "Normals",
            {part({"X", "Y", "Z"})},
            "map.exr: has no R, G, B and no luminance Y that could light, only X, Y, Z; write the map with R, G and B"},
        Case{"MattesAlone",
             {part(together({layer("crypto00"), layer("crypto01")}))},
             "map.exr: has no R, G, B and no luminance Y that could light, only crypto00.B, crypto00.G, crypto00.R, "
             "crypto01.B, crypto01.G, crypto01.R; --layer NAME lights with a layer of your choice"},
        Case{"Nothing",
             {part({})},
             "map.exr: has no R, G, B and no luminance Y that could light, only ; write the map with R, G and B"},
        Case{"DeepAlone",
             {{"deep", false, {"B", "G", "R"}}},
             "map.exr: holds deep samples only; flatten it to an image first"}),
    [](const auto& info) { return info.param.name; });

const std::vector<ExrPart>& studio() {
    static const std::vector<ExrPart> parts = {part({"Z"}, "depth"),
                                               part(together({layer("View.AO"), layer("View.Combined")}), "main"),
                                               part({"B", "G", "R"}, "normals"),
                                               {"deep", false, {"B", "G", "R"}}};
    return parts;
}

TEST(ExrLayerRequest, NamesALayerInAnyCaseByItsWholeNameOrItsEnd) {
    for (const char* name : {"View.AO", "view.ao", "AO", "ao"}) {
        EXPECT_EQ(choice(studio(), {name, {}}), "1 View.AO: View.AO.R View.AO.G View.AO.B") << name;
    }
    EXPECT_EQ(choice(studio(), {"normals", {}}), "2 : R G B") << "what is asked for by name lights";
    EXPECT_EQ(choice(studio(), {"O", {}}),
              "map.exr: has no layer O; its layers are depth, View.AO, View.Combined, normals");
    EXPECT_EQ(choice(studio(), {"depth", {}}), "map.exr: layer depth cannot light: it has Z and no R, G, B or Y");
    EXPECT_EQ(choice({part({"B", "G", "R"})}, {"sky", {}}),
              "map.exr: has no layer sky; its channels belong to none, and --layer is not needed");
    EXPECT_EQ(choice({part(together({layer("A.Sky"), layer("B.Sky")}))}, {"sky", {}}),
              "map.exr: sky could be A.Sky, B.Sky; give --layer the whole name");
    EXPECT_EQ(choice({part({"B", "G", "R"}, "A.Sky"), part({"B", "G", "R"}, "B.Sky")}, {"sky", {}}),
              "map.exr: sky could be A.Sky, B.Sky; give --layer the whole name");
}

TEST(ExrLayerRequest, NumbersAPart) {
    EXPECT_EQ(choice(studio(), {{}, 2}), "2 : R G B");
    EXPECT_EQ(choice(studio(), {{}, 1}), "1 View.Combined: View.Combined.R View.Combined.G View.Combined.B");
    EXPECT_EQ(choice(studio(), {"AO", 1}), "1 View.AO: View.AO.R View.AO.G View.AO.B");
    EXPECT_EQ(choice(studio(), {"AO", 0}), "map.exr: has no layer AO; its layers are depth");
    EXPECT_EQ(choice(studio(), {{}, 0}),
              "map.exr: has no R, G, B and no luminance Y that could light, only Z; write the map with R, G and B");
    EXPECT_EQ(choice(studio(), {{}, 3}),
              "map.exr: part 3 holds deep samples; flatten it first, or choose another with --part");
    EXPECT_EQ(choice(studio(), {{}, 4}), "map.exr: has no part 4; its parts are 0 to 3");
    EXPECT_EQ(choice({part({"B", "G", "R"})}, {{}, 1}), "map.exr: has no part 1, only part 0");
}

TEST(ExrLayerRequest, IsNotNeededWhereOnlyTheOrderDecidesButTheOthersAreTold) {
    const std::vector<ExrPart> parts = {part({"B", "G", "R"}, "left"), part({"B", "G", "R"}, "right")};
    EXPECT_EQ(choose_layer("map.exr", parts, {}).passed_over, std::vector<std::string>{"right"});
    EXPECT_TRUE(choose_layer("map.exr", studio(), {}).passed_over.empty());
}

}  // namespace
}  // namespace clerestory
