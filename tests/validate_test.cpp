// The validation suite in its short form: every check not known to fail holds, and its report is well-formed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <ostream>

#include "native/solver_kernels.hpp"
#include "page/svg_plot.hpp"
#include "validate/golden.hpp"
#include "validate/report.hpp"
#include "validate/suite.hpp"

namespace fathom::validate::validate_test {

void PrintTo(const Case& test, std::ostream* out) { *out << test.about; }

namespace {

class Suite : public testing::TestWithParam<Case> {};

TEST_P(Suite, Holds) {
  const Result result = run_case(GetParam(), {.threads = 1, .full = false});
  EXPECT_FALSE(result.record.checks.empty());
  for (const Check& check : result.record.checks) {
    if (!check.known.empty()) continue;
    EXPECT_TRUE(check.passed()) << check.name << ": " << check.value << " " << check.unit << ", must be "
                                << (check.at_most ? "at most " : "at least ") << check.limit;
  }
}

std::string test_name(const testing::TestParamInfo<Case>& info) {
  std::string name = info.param.name;
  std::ranges::replace(name, '-', '_');
  return "case_" + name;
}
INSTANTIATE_TEST_SUITE_P(Validation, Suite, testing::ValuesIn(cases().begin(), cases().end()), test_name);

// The same bits with any of the machine's vector widths.
TEST(Golden, VectorWidthDoesNotMatter) {
  for (const char* name : {"AVX3", "AVX2", "NEON", "single"}) {
    if (!native::select_kernels(name)) continue;
    for (const Golden& golden : goldens()) {
      const Hashes found = run_golden(golden, {.threads = 1});
      EXPECT_EQ(found.state, golden.native.state) << name << ", " << golden.environment;
      EXPECT_EQ(found.events, golden.native.events) << name << ", " << golden.environment;
    }
  }
  native::select_kernels(nullptr);
}

TEST(Golden, DeviceSimulatorOnTheHost) {
  for (const Golden& golden : goldens()) {
    const Hashes found = run_golden(golden, {SimulatorKind::device, "host", 2});
    EXPECT_EQ(found.state, golden.device.state) << golden.environment;
    EXPECT_EQ(found.events, golden.device.events) << golden.environment;
  }
}

const Case sample{"group", "sample", "A & B", [](const Setup&, Record& record) {
                    record.at_most("good", 1, 2, "m");
                    record.at_least("bad <", 1, 2);
                    record.at_most("hopeless", 1, 0).known = "a reason";
                    record.tables.push_back({"table", {"a", "b"}, {{"1", "2"}}});
                    Plot plot{"plot", "x", "y", true, true, {}};
                    plot.curves.push_back({"curve", {1, 10, 0, 100}, {1, 2, 3, 4}});
                    record.plots.push_back(plot);
                    record.note("a note");
                  }};

const Case throwing{"g", "n", "", [](const Setup&, Record&) { throw Error(ErrorCode::capacity, "too many"); }};

TEST(Report, TellsWhatPassedAndWhatFailed) {
  const validate::Setup setup;
  const std::vector<Result> results{run_case(sample, setup)};
  EXPECT_FALSE(results[0].passed());
  EXPECT_FALSE(results[0].as_expected());
  const auto json = nlohmann::json::parse(to_json(results, setup, {}));
  EXPECT_EQ(json["checks"], 3);
  EXPECT_EQ(json["passed"], 1);
  EXPECT_EQ(json["known_failures"], 1);
  EXPECT_EQ(json["cases"][0]["checks"][2]["known"], "a reason");
  const std::string html = to_html(results, setup, {});
  EXPECT_THAT(html, testing::HasSubstr("1 of 3 checks pass; 1 fail as known, 1 fail."));
  EXPECT_THAT(html, testing::HasSubstr("bad &lt;"));
  EXPECT_THAT(html, testing::HasSubstr("<svg"));
  EXPECT_THAT(to_text(results[0]), testing::HasSubstr("fail  sample"));
}

TEST(Report, PlotsLeaveOutWhatTheirAxesCannotShow) {
  Plot plot{"p", "x", "y", false, true, {}};
  plot.curves.push_back({"c", {0, 1, 2}, {0, 10, 100}});  // zero has no logarithm
  EXPECT_THAT(page::to_svg(plot), testing::HasSubstr("M337.0"));
  plot.curves.clear();
  EXPECT_THAT(page::to_svg(plot), testing::HasSubstr("</svg>"));
}

TEST(Report, ACurveOfOnePointHasAMark) {
  Plot plot{"p", "x", "y", true, false, {}};
  plot.curves.push_back({"published", {100}, {2}, 6, true});
  EXPECT_THAT(page::to_svg(plot), testing::HasSubstr("reference mark"));
  EXPECT_THAT(page::legend_of(plot), testing::HasSubstr("reference mark"));
  plot.curves.front().add(1000, 20);
  EXPECT_THAT(page::to_svg(plot), testing::Not(testing::HasSubstr("mark")));
}

TEST(Report, ErrorOfTheEngineIsAFailedCheck) {
  const Result result = run_case(throwing, {});
  ASSERT_EQ(result.record.checks.size(), 1u);
  EXPECT_THAT(result.record.checks[0].name, testing::HasSubstr("too many"));
  EXPECT_FALSE(result.as_expected());
}

}  // namespace
}  // namespace fathom::validate::validate_test
