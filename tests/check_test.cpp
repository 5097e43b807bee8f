// Checks report what failed, for which body and in which step; exceeded bounds are reported.
#include "check/check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "exec/host/host_device.hpp"
#include "world_fixture.hpp"

namespace fathom::test::check_test {
namespace {

std::vector<check::Failure> failures;

class Checks : public testing::Test {
 protected:
  void SetUp() override {
    failures.clear();
    check::set_handler([](const check::Failure& f) { failures.push_back(f); });
  }
  void TearDown() override { check::set_handler(nullptr); }
};

TEST_F(Checks, NameBodyStepAndExpression) {
  if (!check::asserts) GTEST_SKIP() << "a build without checks";
  World world(quiet_world());
  run(world, 3);
  const int two = 2;
  FATHOM_ASSERT(two == 2, 5);
  EXPECT_TRUE(failures.empty());
  FATHOM_ASSERT(two == 3, 7);
  ASSERT_EQ(failures.size(), 1u);
  EXPECT_STREQ(failures[0].condition, "two == 3");
  EXPECT_THAT(failures[0].file, testing::HasSubstr("check_test.cpp"));
  EXPECT_EQ(failures[0].body, 7u);
  EXPECT_EQ(failures[0].step, 3u);
}

TEST_F(Checks, AreNotEvaluatedWhereTheyAreOff) {
  int calls = 0;
  [[maybe_unused]] const auto look = [&] { return ++calls > 0; };
  FATHOM_ASSERT(look());
  FATHOM_VALIDATE(look());
  EXPECT_EQ(calls, check::asserts + check::validates);
}

/// One phase of ten items.
struct TenItems {
  std::uint32_t* done;
  std::uint32_t* overruns;

  FATHOM_HD std::uint32_t phases() const { return 1; }
  FATHOM_HD std::uint32_t items(std::uint32_t) const { return 10; }
  FATHOM_HD void operator()(std::uint32_t, std::uint32_t) const { ++*done; }
  FATHOM_HD void report_overrun() const { ++*overruns; }
};

TEST_F(Checks, MoreItemsThanWereLaunchedForAreReported) {
  exec::HostDevice device(1);
  std::uint32_t done = 0, overruns = 0;
  device.parallel_phases(1, 10, TenItems{&done, &overruns});
  device.wait();
  EXPECT_EQ(done, 10u);
  EXPECT_EQ(overruns, 0u);
  device.parallel_phases(1, 4, TenItems{&done, &overruns});
  device.wait();
  EXPECT_EQ(done, 14u);
  EXPECT_EQ(overruns, 1u);
  EXPECT_EQ(failures.empty(), !check::asserts);
}

}  // namespace
}  // namespace fathom::test::check_test
