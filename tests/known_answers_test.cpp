// Whether a driver that computes wrongly is noticed: programs with a mistake are put in the place of the kernels' own.
#include "render/known_answers.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <CL/opencl.hpp>

#include <string>

#include "cl/program.hpp"
#include "error.hpp"
#include "maps.hpp"
#include "run_program.hpp"
#include "sampling/stage3_sample.hpp"
#include "tables/stage2_cdf.hpp"
#include "test_device.hpp"

namespace clerestory::test {
namespace {

using testing::HasSubstr;

/// A device laid out as an accelerator: its programs have defines that are known here.
class KnownAnswersTest : public testing::Test {
  protected:
    /// Puts the program of `file` with `right` replaced by `wrong` where the device's programs are kept.
    void spoil(const std::string& file, const std::string& defines, const std::string& right,
               const std::string& wrong) {
        std::string source = assembled_source(file);
        const std::string key = program_key(device_, source, defines);
        const auto at = source.find(right);
        ASSERT_NE(at, std::string::npos) << file << " no longer has: " << right;
        source.replace(at, right.size(), wrong);
        cl::Program program(device_.context(), source);
        program.build(device_.handle(), build_options(device_, defines).c_str());
        device_.program_cache().store(key, program.getInfo<CL_PROGRAM_BINARIES>().at(0));
    }

    /// Of a sampler of the map that is asked about: 8 rows of 16 columns.
    std::string drawing() {
        const RadianceMap map = ramp_map(16, 8);
        return draw_defines(TableBuilder(device_).build(DeviceMap(device_, map)), {});
    }

    TempFolder folder_;
    DeviceOptions options_ = test_options({.act_as = ActAs::accelerator, .program_cache = folder_.path()});
    Device device_{options_};
};

TEST_F(KnownAnswersTest, AreRightOnEveryLayout) {
    EXPECT_EQ(ask_known_answers(device_).wrong, "");
    EXPECT_EQ(ask_known_answers(TestDevice()).wrong, "");
    EXPECT_EQ(ask_known_answers(TestDevice({.act_as = ActAs::flushing_accelerator})).wrong, "");
}

TEST_F(KnownAnswersTest, TellDirectionsThatAreUpsideDownOrMirrored) {
    for (const char* wrong : {"{sine * azimuth.cosine, -cosine, sine * azimuth.sine}",
                              "{sine * azimuth.sine, cosine, sine * azimuth.cosine}"}) {
        spoil("stage3_sample.cl", drawing(), "{sine * azimuth.cosine, cosine, sine * azimuth.sine}", wrong);
        EXPECT_THAT(ask_known_answers(device_).wrong, HasSubstr("leads elsewhere")) << wrong;
    }
}

TEST_F(KnownAnswersTest, TellDensitiesThatAreOff) {
    spoil("stage3_sample.cl", drawing(), "TABLE_UNIT * (float)(row_end - row_start)",
          "1.001f * TABLE_UNIT * (float)(row_end - row_start)");
    EXPECT_THAT(ask_known_answers(device_).wrong, HasSubstr("has the density"));
}

TEST_F(KnownAnswersTest, TellASequenceThatStandsStill) {
    spoil("stage3_sample.cl", drawing(), "const uint item = (uint)get_global_id(0);",
          "const uint item = (uint)get_global_id(0) & ~127u;");
    EXPECT_NE(ask_known_answers(device_).wrong, "");
}

TEST_F(KnownAnswersTest, TellAPreviewOfTheWrongChannel) {
    spoil("display.cl", "", "tone(exposure * pixel[1], step) << 8", "tone(exposure * pixel[0], step) << 8");
    EXPECT_THAT(ask_known_answers(device_).wrong, HasSubstr("is shown as"));
}

/// What was answered once is known from then on, and a device that answered wrongly is refused by every command.
TEST_F(KnownAnswersTest, AreRememberedAndRefuseTheDevice) {
    spoil("stage3_sample.cl", drawing(), "TABLE_UNIT * (float)(row_end - row_start)",
          "2.0f * TABLE_UNIT * (float)(row_end - row_start)");
    const std::string wrong = known_answers(device_).wrong;
    EXPECT_THAT(wrong, HasSubstr("has the density"));
    const TempFolder out;
    const ProgramSetting cached{.environment = {{"CLERESTORY_CACHE_DIR", folder_.path().string()}}};
    for (const std::string command : {"render", "sample", "fresnel", "sheet"}) {
        const auto result = run_program({command, "-o", out.file("x.png"), "--act-as", "accelerator"}, cached);
        EXPECT_EQ(result.exit_code, 4) << command;
        EXPECT_THAT(result.err, AllOf(HasSubstr("gives wrong answers"), HasSubstr(wrong))) << command;
    }
    EXPECT_TRUE(names_in(out.path()).empty());
    const auto devices = run_program({"devices", "--act-as", "accelerator"}, cached);
    EXPECT_THAT(devices.out, AllOf(HasSubstr("verdict   cannot be used"), HasSubstr(wrong)));
    EXPECT_EQ(devices.exit_code, 4);
    EXPECT_EQ(known_answers(device_).wrong, wrong);
    EXPECT_THAT(run_program({"devices"}).out, HasSubstr("verdict   known answers right"));
}

}  // namespace
}  // namespace clerestory::test
