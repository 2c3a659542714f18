// Drivers in trouble: what is wrong with one is told, and it takes no other along.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "run_program.hpp"
#include "test_device.hpp"

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

/// The drivers that the loader finds, and a broken one before them.
class Drivers : public testing::Test {
  protected:
    void SetUp() override {
        if (!test_options().selector.empty()) GTEST_SKIP() << "drivers are numbered anew here";
    }

    void add_working() {
        for (const auto& entry : fs::directory_iterator("/etc/OpenCL/vendors")) {
            fs::copy_file(entry.path(), folder_.path() / "vendors" / entry.path().filename());
        }
    }
    void add(const std::string& library) { std::ofstream(folder_.path() / "vendors" / "0.icd") << library << '\n'; }

    ProgramResult run(const std::vector<std::string>& words, const std::string& mode = "") {
        return run_program(
            words, {.environment = {{"OCL_ICD_VENDORS", folder_.file("vendors")}, {"CLERESTORY_BROKEN_DRIVER", mode}}});
    }
    ProgramResult render(const std::string& mode = "") {
        return run({"render", "-n", "8", "--size", "9", "-o", folder_.file("x.exr")}, mode);
    }

    TempFolder folder_;
    bool made_ = fs::create_directory(folder_.path() / "vendors");
};

TEST_F(Drivers, OneInTroubleTakesNoOtherAlong) {
    add_working();
    add(CLERESTORY_BROKEN_DRIVER);
    for (const std::string mode : {"platform", "devices", "device", "crash"}) {
        EXPECT_EQ(render(mode).exit_code, 0) << mode;
        const auto devices = run({"devices", "--json", "-"}, mode);
        EXPECT_EQ(devices.exit_code, 0) << mode << ": " << devices.err;
        std::size_t usable = 0;
        std::string troubles;
        const json listed = json::parse(devices.out);
        for (const json& device : listed["devices"]) {
            if (device.value("usable", false)) ++usable;
            if (!device.value("usable", true)) troubles += device.value("verdict", "");
        }
        EXPECT_GE(usable, 1U) << mode;
        EXPECT_THAT(troubles, HasSubstr(mode == "platform"  ? "CL_OUT_OF_HOST_MEMORY"
                                        : mode == "devices" ? "it gives no device: CL_OUT_OF_RESOURCES"
                                        : mode == "device"  ? "CL_INVALID_DEVICE"
                                                            : "its driver ends the program by signal 6"))
            << mode;
    }
}

TEST_F(Drivers, OneThatIsNotThereOrNoDriverTakesNoOtherAlong) {
    add_working();
    for (const char* library : {"/nowhere/libdriver.so", CLERESTORY_HOSTILE_MODULE, ""}) {
        add(library);
        EXPECT_EQ(render().exit_code, 0) << library;
        EXPECT_EQ(run({"devices"}).exit_code, 0) << library;
    }
}

TEST_F(Drivers, ABrokenOneAloneEndsWithFourAndWhatIsWrong) {
    add(CLERESTORY_BROKEN_DRIVER);
    for (const std::string mode : {"platform", "devices", "device"}) {
        const auto result = render(mode);
        EXPECT_EQ(result.exit_code, 4) << mode;
        EXPECT_THAT(result.err, HasSubstr("no OpenCL device that works on this machine")) << mode;
        EXPECT_EQ(run({"devices"}, mode).exit_code, 4) << mode;
        EXPECT_EQ(run({"--version"}, mode).exit_code, 0) << mode;
    }
}

TEST_F(Drivers, NoneAtAllEndsWithFourAndWhatToInstall) {
    for (const std::string command : {"render", "devices", "sample"}) {
        const auto result = command == "devices" ? run({command}) : run({command, "-o", folder_.file("x.exr")});
        EXPECT_EQ(result.exit_code, 4) << command;
        EXPECT_THAT(result.err, HasSubstr("install pocl-opencl-icd")) << command;
    }
    EXPECT_FALSE(fs::exists(folder_.path() / "x.exr"));
    EXPECT_THAT(run({"--version"}).out, HasSubstr("device    none: "));
}

}  // namespace
}  // namespace clerestory::test
