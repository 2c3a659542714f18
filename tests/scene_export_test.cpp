// Exported scenes: each renderer's documented convention, applied to the matrix that the file holds, must find the
// texel that this program finds.
#include "picture/scene_export.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <sstream>

#include "error.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

using Vector = std::array<double, 3>;

constexpr double PI = std::numbers::pi;
// Fractions of the map's sides: an arc tangent or a cosine of double, and a matrix of rounded sines; near the poles, at
// 1e-3 of them, the arc cosine loses three digits.
constexpr double FRACTION_TOLERANCE = 1e-12;

/// A place in the map: fractions of its width from the left edge and of its height from the top edge.
struct Place {
    double across;
    double down;
};

double fraction(double value) { return value - std::floor(value); }

/// This program's convention (ARCHITECTURE.md, kernels/latlong.clh): where in the file the light from `d` stands.
Place own_place(const Vector& d, bool flip_y, double rotate_y_deg) {
    const double phi = std::atan2(d[2], d[0]);
    const double down = std::acos(d[1]) / PI;
    return {fraction(phi / (2 * PI) - rotate_y_deg / 360), flip_y ? 1 - down : down};
}

/// Mitsuba 3, envmap: u = atan2(x, -z) / 2 pi, v = acos(y) / pi.
Place mitsuba_place(const Vector& local) {
    return {fraction(std::atan2(local[0], -local[2]) / (2 * PI)), std::acos(local[1]) / PI};
}

/// pbrt-v4, imgtool makeequiarea: the spherical angles about +z, phi / 2 pi and theta / pi.
Place pbrt_place(const Vector& local) {
    return {fraction(std::atan2(local[1], local[0]) / (2 * PI)), std::acos(local[2]) / PI};
}

/// The 16 numbers that stand between `before` and `after`.
std::vector<double> matrix_in(const std::string& text, const std::string& before, const std::string& after) {
    const auto start = text.find(before);
    EXPECT_NE(start, std::string::npos) << text;
    const auto end = text.find(after, start + before.size());
    std::istringstream words(text.substr(start + before.size(), end - start - before.size()));
    std::vector<double> numbers;
    for (double number = 0; words >> number;) numbers.push_back(number);
    EXPECT_EQ(numbers.size(), 16U) << text;
    return numbers;
}

/// The renderer's place of a world direction by the matrix in its scene file; its inverse is its transpose.
Place exported_place(SceneFormat format, const ExportedScene& scene, const Vector& d) {
    const std::string text = scene_text(format, scene);
    const bool by_rows = format == SceneFormat::mitsuba;
    const auto m = by_rows ? matrix_in(text, "<matrix value=\"", "\"") : matrix_in(text, "Transform [", "]");
    Vector local{};
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) local[j] += m[by_rows ? 4 * i + j : 4 * j + i] * d[i];
    }
    for (double& value : local) value = std::clamp(value, -1.0, 1.0);
    return by_rows ? mitsuba_place(local) : pbrt_place(local);
}

struct Orientation {
    SceneFormat format;
    bool flip_y;
    double rotate_y_deg;
};
std::string name_of(const Orientation& what) {
    std::ostringstream name;
    name << (what.format == SceneFormat::pbrt ? "pbrt" : "mitsuba") << (what.flip_y ? "FlippedBy" : "By")
         << (what.rotate_y_deg < 0 ? "Minus" : "") << std::abs(std::round(what.rotate_y_deg));
    return name.str();
}
void PrintTo(const Orientation& what, std::ostream* out) { *out << name_of(what); }

std::vector<Orientation> orientations() {
    std::vector<Orientation> all;
    for (const SceneFormat format : {SceneFormat::pbrt, SceneFormat::mitsuba}) {
        for (const bool flip : {false, true}) {
            for (const double angle : {0.0, 90.0, 33.3, -120.0, 725.0}) all.push_back({format, flip, angle});
        }
    }
    return all;
}

class SceneOrientation : public ::testing::TestWithParam<Orientation> {};

TEST_P(SceneOrientation, TheRenderersConventionFindsOurTexel) {
    const Orientation& what = GetParam();
    ExportedScene scene;
    scene.map = "map.exr";
    scene.flip_y = what.flip_y;
    scene.rotate_y_deg = what.rotate_y_deg;
    constexpr int STEPS = 37;
    for (int i = 0; i < STEPS; ++i) {
        for (int j = 0; j < 2 * STEPS; ++j) {
            const double theta = 1e-3 + (PI - 2e-3) * i / (STEPS - 1);
            const double phi = 2 * PI * (j + 0.25) / (2 * STEPS);
            const Vector d = {std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
            const Place expected = own_place(d, what.flip_y, what.rotate_y_deg);
            const Place found = exported_place(what.format, scene, d);
            // The left edge is the right edge.
            EXPECT_NEAR(std::remainder(found.across - expected.across, 1.0), 0, FRACTION_TOLERANCE);
            EXPECT_NEAR(found.down, expected.down, FRACTION_TOLERANCE);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Orientations, SceneOrientation, ::testing::ValuesIn(orientations()),
                         [](const auto& info) { return name_of(info.param); });

TEST(SceneExport, AnAlbedoAboveOneGoesIntoTheLight) {
    ExportedScene scene;
    scene.map = "map.exr";
    scene.scale = 3;
    scene.albedo = 2;
    EXPECT_NE(scene_text(SceneFormat::mitsuba, scene).find("name=\"scale\" value=\"6\""), std::string::npos);
    EXPECT_NE(scene_text(SceneFormat::mitsuba, scene).find("name=\"reflectance\" value=\"1\""), std::string::npos);
    EXPECT_NE(scene_text(SceneFormat::pbrt, scene).find("\"float scale\" 6\n"), std::string::npos);
    EXPECT_NE(scene_text(SceneFormat::pbrt, scene).find("[ 1 1 1 ]"), std::string::npos);
}

TEST(SceneExport, NamesAreQuotedAsEachFormatAsks) {
    ExportedScene scene;
    scene.map = "a \"b\" & <c>.exr";
    EXPECT_NE(scene_text(SceneFormat::mitsuba, scene).find("a &quot;b&quot; &amp; &lt;c&gt;.exr"), std::string::npos);
    EXPECT_NE(scene_text(SceneFormat::pbrt, scene).find(R"(_equiarea.exr 'a "b" & <c>.exr')"), std::string::npos);
    scene.stem = R"(a "b" \)";
    EXPECT_NE(scene_text(SceneFormat::pbrt, scene).find(R"("string filename" "a \"b\" \\_equiarea.exr")"),
              std::string::npos);
}

TEST(SceneExport, ANameIsNothingThatASceneOrAShellWouldObey) {
    ExportedScene scene;
    scene.map = "-$(touch proof)\nWorldEnd.exr";
    scene.stem = "s\nShape \"disk\"\t";
    const std::string pbrt = scene_text(SceneFormat::pbrt, scene);
    EXPECT_NE(pbrt.find(R"(--outfile $'s\012Shape "disk"\011_equiarea.exr' $'./-$(touch proof)\012WorldEnd.exr')"
                        "\n"),
              std::string::npos)
        << pbrt;
    EXPECT_NE(pbrt.find(R"("s\nShape \"disk\"\t_equiarea.exr")"), std::string::npos) << pbrt;
    EXPECT_EQ(pbrt.find("\nWorldEnd"), std::string::npos);
    EXPECT_EQ(pbrt.find("\nShape \"disk"), std::string::npos);
    const std::string xml = scene_text(SceneFormat::mitsuba, scene);
    EXPECT_NE(xml.find("value=\"-$(touch proof)&#10;WorldEnd.exr\""), std::string::npos) << xml;
    for (const char* name : {"a\033.exr", "a\x7f.exr", "a\xff.exr", "a\xc2\x9b.exr"}) {
        scene.map = name;
        EXPECT_THROW(scene_text(SceneFormat::mitsuba, scene), OutputError) << name;
        EXPECT_NO_THROW(scene_text(SceneFormat::pbrt, scene)) << name;
    }
}

TEST(SceneExport, RenderWritesTheScenesBesideItsPicture) {
    const TempFolder folder;
    const ProgramResult result = run_program({"render", "-n", "16", "--size", "33", "--rotate-y", "90", "--scale", "2",
                                              "-o", folder.file("s.exr"), "--export", "pbrt,mitsuba"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{"s.exr", "s.pbrt", "s.xml", "s_map.exr"}));
    const std::string pbrt = read_file(folder.path() / "s.pbrt");
    EXPECT_NE(pbrt.find("\"integer xresolution\" 33"), std::string::npos) << pbrt;
    EXPECT_NE(pbrt.find("\"integer pixelsamples\" 16"), std::string::npos) << pbrt;
    EXPECT_NE(pbrt.find("\"s_equiarea.exr\""), std::string::npos) << pbrt;
    const std::string xml = read_file(folder.path() / "s.xml");
    // The bundled city names chromaticities, by which other renderers convert its colours.
    EXPECT_NE(xml.find("/s_map.exr\"/>"), std::string::npos) << xml;
    EXPECT_NE(xml.find("name=\"scale\" value=\"2\""), std::string::npos) << xml;
}

TEST(SceneExport, AnUnknownRendererIsAUsageError) {
    EXPECT_EQ(run_program({"render", "--export", "blender"}).exit_code, 2);
    EXPECT_THROW(scene_format_by_name("blender"), UsageError);
}

}  // namespace
}  // namespace clerestory::test
