#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "cl/shared_kernel_types.hpp"
#include "test_device.hpp"

namespace clerestory {
namespace {

using test::TestDevice;

using testing::AllOf;
using testing::HasSubstr;

/// The text of the DeviceError that `action` must end in.
template <class F>
std::string device_error(F&& action) {
    try {
        action();
    } catch (const DeviceError& error) {
        EXPECT_EQ(error.exit_code(), 4);
        return error.what();
    }
    ADD_FAILURE() << "no DeviceError";
    return {};
}

class Cl : public testing::Test {
  protected:
    TestDevice device_;
};

using Floats = Buffer<cl_float>;
using Uints = Buffer<cl_uint>;

/// Large buffers of a CPU lie in memory of this program, which must not be freed under commands that still use it.
TEST_F(Cl, ALargeBufferOutlivesItsOwnerUntilItsLastCommandHasEnded) {
    constexpr std::size_t COUNT = (std::size_t{1} << 22) + 1;
    constexpr cl_uint VALUE = 0xC1E4E570;
    const Uints kept(device_, "what is kept", COUNT);
    for (int round = 0; round < 4; ++round) {
        Uints large(device_, "what goes", COUNT);
        large.fill(VALUE + static_cast<cl_uint>(round));
        device_.queue().enqueueCopyBuffer(large.handle(), kept.handle(), 0, 0, large.bytes());
    }
    EXPECT_EQ(kept.download(), std::vector<cl_uint>(COUNT, VALUE + 3));
}

/// A float in place of a uint would be accepted in silence by the driver.
TEST_F(Cl, AnArgumentOfAnotherTypeIsRefusedByNameAndPlace) {
    const Program program(device_, "display.cl");
    using Wrong = Kernel<Uints, cl_uint, cl_float, cl_uint, Uints>;
    EXPECT_THAT(device_error([&] { Wrong(device_, program, "mark_samples"); }),
                AllOf(HasSubstr("kernel mark_samples of kernels/display.cl"),
                      HasSubstr("argument 2 is uint there and float here")));
    using WrongBuffer = Kernel<Floats, cl_uint, cl_uint, cl_uint, Uints>;
    EXPECT_THAT(device_error([&] { WrongBuffer(device_, program, "mark_samples"); }),
                HasSubstr("argument 0 is uint* there and float* here"));
    using Right = Kernel<Uints, cl_uint, cl_uint, cl_uint, Uints>;
    EXPECT_NO_THROW(Right(device_, program, "mark_samples"));
}

TEST_F(Cl, AWrongCountOfArgumentsIsRefused) {
    const Program program(device_, "display.cl");
    using TooFew = Kernel<Uints, cl_uint, cl_uint, cl_uint>;
    EXPECT_THAT(device_error([&] { TooFew(device_, program, "mark_samples"); }), HasSubstr("takes 5 arguments, not 4"));
}

TEST_F(Cl, AStructOfAnotherNameIsRefused) {
    const Program program(device_, "stage1_weight.cl");
    using Wrong = Kernel<Buffer<RowWeight>, cl_uint, cl_uint, cl_uint, Buffer<TexelCounts>>;
    EXPECT_THAT(device_error([&] { Wrong(device_, program, "join_counts"); }),
                HasSubstr("argument 0 is TexelCounts* there and RowWeight* here"));
}

TEST_F(Cl, AnUnknownKernelIsNamed) {
    const Program program(device_, "display.cl");
    EXPECT_THAT(device_error([&] { Kernel<cl_uint>(device_, program, "no_such_kernel"); }),
                AllOf(HasSubstr("no_such_kernel"), HasSubstr("display.cl")));
}

TEST_F(Cl, AnUnknownSourceIsNamed) {
    EXPECT_THAT(device_error([&] { Program(device_, "no_such_file.cl"); }), HasSubstr("no_such_file.cl"));
}

/// A define that cannot compile shows in an included file: the message names that file and its own line.
TEST_F(Cl, ABuildErrorNamesTheKernelsFileAndLine) {
    const std::string error = device_error([&] { Program(device_, "stage4_shade.cl", "-DPIXELS_WIDE=5"); });
    EXPECT_THAT(error, HasSubstr("building kernels/stage4_shade.cl on "));
    // NVIDIA's compiler calls every source so, whatever #line says.
    const std::string file =
        device_.info().platform == "NVIDIA CUDA" ? "<kernel>" : "kernels/(pixels.clh|stage4_shade.cl)";
    EXPECT_THAT(error, testing::ContainsRegex(file + ":[0-9]+:[0-9]+"));
}

TEST_F(Cl, ABufferBeyondTheDeviceIsRefusedWithItsNameAndSize) {
    constexpr std::size_t COUNT = std::numeric_limits<std::size_t>::max() / 64;
    EXPECT_THAT(device_error([&] { Floats(device_, "the great array", COUNT); }),
                AllOf(HasSubstr("the great array"), HasSubstr(std::to_string(4 * COUNT)), HasSubstr("smaller map")));
}

TEST_F(Cl, RangesOfABufferAreChecked) {
    Uints buffer(device_, "ten numbers", 10);
    std::vector<cl_uint> eleven(11);
    EXPECT_THAT(device_error([&] { buffer.download(eleven); }),
                HasSubstr("reading ten numbers: elements 0 to 11 of 10"));
    EXPECT_THAT(device_error([&] { buffer.upload(std::span<const cl_uint>(eleven.data(), 2), 9); }),
                HasSubstr("elements 9 to 11 of 10"));
    EXPECT_THAT(device_error([&] { buffer.upload(std::span<const cl_uint>(eleven.data(), 0), 11); }),
                HasSubstr("11 of 10"));
    buffer.fill(3);
    buffer.upload(std::vector<cl_uint>{7, 8}, 8);
    EXPECT_EQ(buffer.download(), (std::vector<cl_uint>{3, 3, 3, 3, 3, 3, 3, 3, 7, 8}));
}

TEST_F(Cl, AnEmptyBufferIsNoError) {
    Floats empty(device_, "nothing", 0);
    empty.fill(1);
    EXPECT_TRUE(empty.download().empty());
}

/// Groups are whole: the range is padded up, and nothing beyond it is written.
TEST_F(Cl, RangesArePaddedToWholeGroups) {
    EXPECT_EQ((Range{10, 64}.padded()), 64U);
    EXPECT_EQ((Range{64, 64}.padded()), 64U);
    EXPECT_EQ((Range{65, 64}.padded()), 128U);
    const Program program(device_, "stage1_weight.cl");
    Kernel<Buffer<RowWeight>, cl_uint, cl_uint, Buffer<RowWeight>> join(device_, program, "join_weights");
    const std::vector<RowWeight> parts(10, RowWeight{1, 2, 3});
    const Buffer<RowWeight> from(device_, "parts", std::span<const RowWeight>(parts));
    Buffer<RowWeight> to(device_, "rows", 12);
    to.upload(std::vector<RowWeight>(12, RowWeight{99, 99, 99}));
    join({10, 64}, from, 1U, 10U, to);
    const auto rows = to.download();
    for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(rows[i].sum, i < 10 ? 1U : 99U) << i;
}

TEST_F(Cl, AnEmptyRangeRunsNothing) {
    const Program program(device_, "stage1_weight.cl");
    Kernel<Buffer<RowWeight>, cl_uint, cl_uint, Buffer<RowWeight>> join(device_, program, "join_weights");
    const Buffer<RowWeight> none(device_, "none", 1);
    EXPECT_NO_THROW(join({0, 64}, none, 1U, 0U, none));
    EXPECT_NO_THROW(device_.finish());
}

TEST(ClDevice, BadSelectorsAreUsageErrorsAndAbsentDevicesDeviceErrors) {
    for (const char* bad : {"x", "0", "0:", ":0", "0:0:", "-1:0", "0:a"}) {
        EXPECT_THROW(TestDevice(DeviceOptions{bad, 0, 0}), UsageError) << bad;
    }
    EXPECT_THROW(TestDevice(DeviceOptions{"97:0", 0, 0}), DeviceError);
    EXPECT_FALSE(list_devices().empty());
}

TEST(ClDevice, WorkGroupsStayWithinTheDevice) {
    const TestDevice own;
    EXPECT_EQ(own.work_group(64), 64U);
    EXPECT_EQ(own.work_group(std::numeric_limits<std::size_t>::max()), own.info().max_work_group);
    EXPECT_THROW(TestDevice(DeviceOptions{"", 0, own.info().max_work_group + 1}), UsageError);
    EXPECT_EQ(TestDevice(DeviceOptions{"", 0, 3}).work_group(64), 3U);
    if (test::threads_where_possible(1) == 0) {
        EXPECT_THROW(TestDevice(DeviceOptions{"", 1, 0}), DeviceError);
    } else {
        EXPECT_EQ(TestDevice(DeviceOptions{"", 1, 0}).info().compute_units, 1U);
    }
}

}  // namespace
}  // namespace clerestory
