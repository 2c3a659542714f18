#include "base/available_memory.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <string>

#include "base/atomic_file.hpp"
#include "run_program.hpp"

namespace clerestory {
namespace {

/// A machine's /proc and /sys, made of the files that a test names.
class BudgetTest : public testing::Test {
  protected:
    void put(const std::string& file, const std::string& text) { write_text(root_.path() / file, text); }
    test::TempFolder root_;
};

TEST_F(BudgetTest, IsWhatTheKernelSaysIsAvailable) {
    put("proc/meminfo", "MemTotal:       24684404 kB\nMemFree: 1 kB\nMemAvailable:   1000 kB\n");
    EXPECT_EQ(available_memory(root_.path()), 1024000U);
}

TEST_F(BudgetTest, IsUnboundedWhereNothingIsSaid) {
    EXPECT_EQ(available_memory(root_.path()), std::numeric_limits<std::size_t>::max());
}

TEST_F(BudgetTest, AControlGroupOrItsParentLowersIt) {
    put("proc/meminfo", "MemAvailable: 1000 kB\n");
    put("proc/self/cgroup", "0::/user/job\n");
    put("sys/fs/cgroup/user/job/memory.max", "max\n");
    EXPECT_EQ(available_memory(root_.path()), 1024000U);
    put("sys/fs/cgroup/user/memory.max", "500000\n");
    put("sys/fs/cgroup/user/memory.current", "300000\n");
    EXPECT_EQ(available_memory(root_.path()), 200000U);
    // Pages of files that nobody uses are dropped before memory is refused.
    put("sys/fs/cgroup/user/memory.stat", "anon 200000\ninactive_file 100000\n");
    EXPECT_EQ(available_memory(root_.path()), 300000U);
    put("sys/fs/cgroup/user/memory.current", "700000\n");
    EXPECT_EQ(available_memory(root_.path()), 0U);
}

TEST_F(BudgetTest, TheFirstVersionOfControlGroupsLowersItToo) {
    put("proc/meminfo", "MemAvailable: 1000 kB\n");
    put("proc/self/cgroup", "5:cpu,cpuacct:/a\n4:hugetlb,memory:/job\n");
    put("sys/fs/cgroup/memory/job/memory.limit_in_bytes", "9223372036854771712\n");
    EXPECT_EQ(available_memory(root_.path()), 1024000U);
    put("sys/fs/cgroup/memory/memory.limit_in_bytes", "4096\n");
    put("sys/fs/cgroup/memory/memory.usage_in_bytes", "96\n");
    EXPECT_EQ(available_memory(root_.path()), 4000U);
}

TEST_F(BudgetTest, ThisMachineHasSome) {
    EXPECT_GT(available_memory(), std::size_t{1} << 20);
    EXPECT_LT(available_memory(), std::numeric_limits<std::size_t>::max());
}

TEST_F(BudgetTest, SizesAreWrittenForPeople) {
    EXPECT_EQ(format_bytes(812), "812 B");
    EXPECT_EQ(format_bytes(3200000), "3.2 MB");
    EXPECT_EQ(format_bytes(1.6106e9), "1.61 GB");
    EXPECT_EQ(format_bytes(1.38e19), "1.38e+07 TB");
}

}  // namespace
}  // namespace clerestory
