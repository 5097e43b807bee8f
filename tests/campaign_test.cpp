// The campaign's parts: what it plans, rejects, stores, reports and compares.
#include "bench/campaign/campaign.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "bench/campaign/compare.hpp"
#include "bench/campaign/crossover.hpp"
#include "bench/campaign/published.hpp"
#include "bench/campaign/report.hpp"
#include "bench/campaign/view.hpp"
#include "scene/environments.hpp"
#include "test_folder.hpp"

namespace fathom::campaign::campaign_test {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

const Offer sixteen_and_gpu{16, {"host", "cuda:0"}};

TEST(CampaignPlan, ThreadsGoUpToWhatTheMachineHas) {
  EXPECT_THAT(thread_counts(1), ElementsAre(1));
  EXPECT_THAT(thread_counts(6), ElementsAre(1, 2, 4, 6));
  EXPECT_THAT(thread_counts(64), ElementsAre(1, 2, 4, 8, 16, 32));
  EXPECT_EQ(table_threads(16), 8);
  EXPECT_EQ(table_threads(2), 2);
}

TEST(CampaignPlan, EveryFormHasEveryEnvironmentAndNoCaseTwice) {
  for (const Form form : {Form::quick, Form::full, Form::huge}) {
    const std::vector<Case> cases = plan(form, sixteen_and_gpu, 1);
    std::vector<std::string> keys;
    for (const Case& c : cases) keys.push_back(key_of(c));
    std::ranges::sort(keys);
    EXPECT_EQ(std::ranges::adjacent_find(keys), keys.end());
    for (const char* key : {"drift-1000-native-8t-fathom", "layers-1000-device-cuda0-8t-dissertation",
                            "spread-1000-hybrid-cuda0-8t-fathom", "pyramid-1240-native-8t-dissertation"})
      EXPECT_TRUE(std::ranges::binary_search(keys, key)) << key << " in " << name_of(form);
  }
}

TEST(CampaignPlan, SyclOnAGpuIsAGpuAndOnAProcessorATest) {
  const Offer offer{16, {"host", "sycl:0", "sycl:1"}, {"host", "sycl:1"}};
  const auto planned = [&](Form form, const char* device) {
    return std::ranges::count_if(plan(form, offer, 1), [&](const Case& c) { return c.device == device; });
  };
  EXPECT_EQ(planned(Form::full, "sycl:0"), planned(Form::full, "sycl:1"));
  EXPECT_GT(planned(Form::huge, "sycl:0"), planned(Form::huge, "sycl:1"));
  EXPECT_EQ(planned(Form::huge, "sycl:1"), planned(Form::full, "sycl:1"));
}

TEST(CampaignPlan, RoundsTakeTurns) {
  const std::vector<Case> cases = plan(Form::quick, {1, {"host"}}, 2);
  const auto second = std::ranges::find(cases, 2, &Case::round);
  ASSERT_NE(second, cases.end());
  EXPECT_EQ(second->environment, cases.front().environment);
  EXPECT_EQ(second->bodies, cases.front().bodies);
}

TEST(CampaignRun, EnergyFromNowhereIsRefused) {
  const Scene stack = pyramid(5), adrift = drift(100);
  Quality quality;
  quality.kinetic_energy_per_body = 13;  // the centres are 1.4 m high on average: 13.8 J
  EXPECT_EQ(refusal(stack, quality, 100), "");
  quality.kinetic_energy_per_body = 500;
  EXPECT_THAT(refusal(stack, quality, 100), HasSubstr("exploded"));
  EXPECT_EQ(refusal(adrift, quality, 1800), "");  // 60 kicks may have added as much
  EXPECT_THAT(refusal(adrift, quality, 1), HasSubstr("exploded"));
  quality = {};
  quality.non_finite = 1;
  EXPECT_THAT(refusal(stack, quality, 100), HasSubstr("not finite"));
}

TEST(CampaignCrossover, LiesWhereTheTimesAreEqual) {
  const auto found = crossover({{100, 1, 10}, {10000, 10, 1}});
  ASSERT_TRUE(found);
  EXPECT_THAT(found->bodies, DoubleNear(1000, 1e-6));
  EXPECT_EQ(found->text(), "≈ 1,000");
  EXPECT_EQ(crossover({{100, 2, 1}, {1000, 2, 1}})->text(), "100 and fewer");
  EXPECT_EQ(crossover({{100, 1, 2}, {1000, 1, 2}})->text(), "none up to 1,000");
  EXPECT_FALSE(crossover({}));
}

TEST(CampaignView, ARunCutShortIsComparedOverTheStepsItMade) {
  // Later steps take ten times as long, as when a tower collapses; the slower simulator never gets there.
  const auto run = [](int threads, double factor, std::uint64_t steps) {
    Measurement m;
    m.what = {"layers", 1000, "native", "", threads, "fathom"};
    m.steps = steps;
    for (std::uint64_t k = 1; k <= steps; ++k) m.samples.push_back({k, factor * (k > 100 ? 10 : 1)});
    m.summary = summarise(m.samples);
    return m;
  };
  Campaign campaign;
  campaign.where.threads = 2;
  campaign.runs = {run(1, 2, 100), run(2, 1, 300)};
  const View view(campaign);
  const auto [one, two] = means_of_common_steps(campaign.runs[0], campaign.runs[1], stages().back());
  EXPECT_DOUBLE_EQ(one / two, 2);
  EXPECT_EQ(view.fastest_native("layers", 1000, "fathom"), &campaign.runs[1]);
}

TEST(CampaignView, AStackThatCreepsIsNotGood) {
  const auto moved = [](const char* environment, float metres) {
    Measurement m;
    m.what = {environment, 385, "native", "", 1, "fathom"};
    m.quality.emplace_back();
    m.quality.back().quality.displacement_max = metres;
    return m;
  };
  EXPECT_EQ(creep_of(moved("pyramid", 0.002f)), "");
  EXPECT_EQ(creep_of(moved("pyramid", 0.064f)), "creeps: 64.0 mm");
  EXPECT_EQ(trouble_of(moved("pyramid", 0.064f)), "");
  EXPECT_EQ(trouble_of(moved("pyramid", 0.2f)), "gave way");
  EXPECT_EQ(creep_of(moved("pyramid", 0.2f)), "");
  EXPECT_EQ(creep_of(moved("drift", 0.064f)), "") << "what need not rest may move";
}

TEST(CampaignPublished, FiguresAreThoseOfTheTables) {
  EXPECT_EQ(published_rows().size(), 45u);
  const auto rows = published_of("pyramid", 1240);
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_DOUBLE_EQ(rows[0]->collision_resolution, 10.591);
  EXPECT_EQ(rows[3]->hardware, "NVIDIA RTX 2070 SUPER");
}

class CampaignFolder : public testing::Test {
 protected:
  Settings small() const {
    Settings settings;
    settings.only = {"pyramid-55-native-1t-fathom", "drift-100-native-1t-fathom"};
    settings.limits.steps = 30;
    return settings;
  }
  static bool go_on(const Progress&) { return true; }

  test::TestFolder folder_;
  Store store_{folder_ / "campaign"};
};

TEST_F(CampaignFolder, GoesOnWhereItWasInterrupted) {
  EXPECT_FALSE(run_campaign(store_, small(), [](const Progress& p) { return p.run < 2 || p.step < 10; }));
  ASSERT_EQ(store_.load().runs.size(), 1u);
  EXPECT_EQ(store_.load().planned, 2u);
  Settings again = small();
  EXPECT_THROW(run_campaign(store_, again, go_on), Error);
  again.resume = true;
  std::size_t started = 0;
  EXPECT_TRUE(run_campaign(store_, again, [&](const Progress& p) {
    started += p.step == 0;
    return true;
  }));
  EXPECT_EQ(started, 1u);  // the completed run is not repeated
  const Campaign campaign = store_.load();
  ASSERT_EQ(campaign.runs.size(), 2u);
  for (const Measurement& run : campaign.runs) {
    EXPECT_EQ(run.samples.size(), 30u);
    EXPECT_EQ(run.hash.size(), 16u);
    EXPECT_GT(run.summary.stages.total.mean, 0);
  }
}

TEST_F(CampaignFolder, RefusesToMixRunsOfOtherLengths) {
  ASSERT_TRUE(run_campaign(store_, small(), go_on));
  Settings longer = small();
  longer.resume = true;
  longer.limits.steps = 31;
  EXPECT_THROW(run_campaign(store_, longer, go_on), Error);
}

TEST_F(CampaignFolder, ReportNeedsNothingFromOutside) {
  ASSERT_TRUE(run_campaign(store_, small(), go_on));
  const std::string html = test::read_text(write_report(store_));
  EXPECT_THAT(html, HasSubstr("</html>"));
  EXPECT_THAT(html, HasSubstr("RTX 2070 SUPER"));
  EXPECT_THAT(html, Not(HasSubstr("http")));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
  for (const char* explained : {"R. J. S. Pereira", "<dt>drift</dt>", "<dt>native</dt>", "<dt>dissertation</dt>"})
    EXPECT_THAT(html, HasSubstr(explained));
  const std::size_t crossover = html.find("<h2 id='crossover'>");
  for (const std::size_t from : {std::size_t{0}, crossover})
    EXPECT_LT(html.find("<th class='n whole'>Whole step</th>", from),
              html.find("<th class='n'>Broad phase</th>", from));
  EXPECT_THAT(html, HasSubstr("Every step of 0.5 s of simulated time"));
  EXPECT_THAT(html, HasSubstr("campaign of 30 steps"));
  EXPECT_THAT(html, HasSubstr("all numbers of threads agree in all 2 scenes"));
}

TEST_F(CampaignFolder, PeersThatWereCutShortAreMarked) {
  const auto row = [](const char* engine, bool cut_short) {
    return Json{{"scene", "drift:5"},
                {"environment", "drift"},
                {"bodies", 5},
                {"steps", 7},
                {"cut_short", cut_short},
                {"engine", engine},
                {"version", "1"},
                {"threads", 1},
                {"step_ms", {{"mean", 1}, {"median", 1}, {"p99", 1}, {"max", 1}}},
                {"ratio_to_fathom", 1},
                {"quality", {{"displacement_max", 0}, {"ground_penetration_max", 0}, {"kinetic_energy_per_body", 0}}},
                {"failed", false},
                {"trouble", ""}};
  };
  Json peers{
      {"kind", "peers"}, {"device", "p"}, {"rounds", 1}, {"build", {{"commit", "c"}}}, {"results", Json::array()}};
  peers["results"].push_back(row("whole", false));
  peers["results"].push_back(row("short", true));
  store_.create();
  store_.write("peers.json", peers.dump());
  const std::string html = test::read_text(write_report(store_));
  EXPECT_THAT(html, HasSubstr("<td class='n'>7</td>"));
  EXPECT_THAT(html, HasSubstr("<td class='n'>7 †</td>"));
}

TEST_F(CampaignFolder, DamagedFoldersAreNamed) {
  store_.create();
  store_.write("campaign.json", "{\"kind\": \"something\"}");
  EXPECT_THROW(store_.load(), Error);
  store_.write("campaign.json", "nonsense");
  EXPECT_THROW(store_.load(), Error);
}

/// A campaign.json with one run in several rounds, whose steps take these times.
std::string write_campaign(const test::TestFolder& folder, const std::string& name,
                           const std::vector<std::vector<double>>& rounds, double moved, const std::string& hash) {
  Json json = {{"kind", "campaign"}, {"circumstances", {{"processor", "p"}, {"threads", 2}}}};
  int round = 0;
  for (const std::vector<double>& blocks : rounds)
    json["runs"].push_back({{"environment", "pyramid"},
                            {"bodies_asked", 55},
                            {"simulator", "native"},
                            {"device", ""},
                            {"threads", 2},
                            {"set", "fathom"},
                            {"round", ++round},
                            {"skipped", ""},
                            {"refused", ""},
                            {"failing", ""},
                            {"state_hash", hash},
                            {"blocks_ms", blocks},
                            {"quality", {{{"displacement_max", moved}}}}});
  std::ofstream(folder / name) << json;
  return folder / name;
}

TEST(CampaignCompare, SaysWhatIsBeyondNoise) {
  const test::TestFolder folder;
  const std::vector<double> once(30, 1.0), little(30, 1.03), twice(30, 2.0);
  const std::string a = write_campaign(folder, "a", {once}, 0.005, "1");
  EXPECT_FALSE(compare(a, a, {}).worse());
  EXPECT_FALSE(compare(a, write_campaign(folder, "b", {little}, 0.005, "1"), {}).worse());  // within 5 %
  const Comparison slower = compare(a, write_campaign(folder, "c", {twice}, 0.005, "1"), {});
  EXPECT_TRUE(slower.differences.at(0).slower);
  EXPECT_THAT(slower.differences.at(0).ratio, DoubleNear(2, 1e-9));
  EXPECT_TRUE(compare(write_campaign(folder, "c", {twice}, 0.005, "1"), a, {}).differences.at(0).faster);
  // If rounds differ as much as the two files, the result is undecided.
  const std::string noisy = write_campaign(folder, "d", {once, twice}, 0.005, "1");
  EXPECT_FALSE(compare(noisy, write_campaign(folder, "e", {twice, twice}, 0.005, "1"), {}).worse());
}

/// A campaign.json or peers.json with one run of `steps` steps, each of `ms` ms.
std::string write_run(const test::TestFolder& folder, const std::string& kind, std::uint64_t steps, double ms,
                      bool cut_short = false) {
  Json run = {{"environment", "pyramid"}, {"threads", 2}, {"steps", steps}, {"cut_short", cut_short}};
  run["step_ms"] = {{"mean", ms}, {"median", ms}, {"mean_of_rounds", {ms, ms}}};
  const Json quality = {{"step", steps}, {"displacement_max", 1e-3 * static_cast<double>(steps)}};
  Json json = {{"kind", kind}, {"device", "p"}, {"circumstances", {{"processor", "p"}, {"threads", 2}}}};
  if (kind == "peers") {
    run.update({{"scene", "pyramid:5"}, {"engine", "fathom"}, {"trouble", ""}, {"quality", quality}});
    json["results"].push_back(run);
  } else {
    run.update({{"bodies_asked", 55}, {"simulator", "native"}, {"device", ""}, {"set", "fathom"}, {"skipped", ""}});
    run.update({{"refused", ""}, {"failing", ""}, {"state_hash", std::to_string(steps)}});
    run["quality"].push_back(quality);
    run["blocks_ms"] = std::vector<double>(steps / 60, ms);
    json["runs"].push_back(run);
  }
  const std::string path = folder / (kind + std::to_string(steps) + std::to_string(ms));
  std::ofstream(path) << json;
  return path;
}

TEST(CampaignCompare, ComparesShortRunsAndOnlyWhatIsAlike) {
  const test::TestFolder folder;
  for (const std::string kind : {"campaign", "peers"}) {
    for (const std::uint64_t steps : {1, 20, 59, 60, 400}) {
      const Comparison twice = compare(write_run(folder, kind, steps, 1), write_run(folder, kind, steps, 2), {});
      EXPECT_TRUE(twice.worse()) << kind << steps;
      EXPECT_NEAR(twice.differences.at(0).ratio, 2, 1e-9) << kind << steps;
      EXPECT_FALSE(twice.nothing_compared());
    }
    const Comparison other = compare(write_run(folder, kind, 30, 1), write_run(folder, kind, 400, 2, true), {});
    EXPECT_TRUE(other.nothing_compared()) << kind;
    EXPECT_FALSE(other.worse()) << "what moved in 30 steps tells nothing about 400";
    EXPECT_THAT(other.text(), HasSubstr("not compared: 30 and 400 steps  (after cut short at 400 steps)"));
    EXPECT_THAT(other.text(), HasSubstr("of 1; the times of 1 are not compared"));
    EXPECT_THAT(other.text(), testing::Not(HasSubstr("1.000")));
  }
  // A campaign's runs have their first seconds in common.
  const Comparison seconds =
      compare(write_run(folder, "campaign", 200, 1, true), write_run(folder, "campaign", 400, 2), {});
  EXPECT_NEAR(seconds.differences.at(0).ratio, 2, 1e-9);
  EXPECT_THAT(seconds.text(), HasSubstr("(before cut short at 200 steps)"));
}

TEST(CampaignCompare, SaysWhatIsLessStable) {
  const test::TestFolder folder;
  const std::vector<double> once(30, 1.0);
  const std::string a = write_campaign(folder, "a", {once}, 0.005, "1");
  EXPECT_FALSE(compare(a, write_campaign(folder, "b", {once}, 0.0055, "2"), {}).worse());
  const Comparison fell = compare(a, write_campaign(folder, "c", {once}, 3, "2"), {});
  EXPECT_TRUE(fell.worse());
  EXPECT_THAT(fell.text(), HasSubstr("LESS STABLE: moved"));
}

TEST(CampaignCompare, HoldsCountsAgainstTheirTolerance) {
  const test::TestFolder folder;
  const auto counts = [&](const std::string& name, int count) {
    std::ofstream(folder / name) << Json{
        {"kind", "instructions"}, {"compiler", "c"}, {"tolerance", 0.02}, {"instructions", {{"layers", count}}}};
    return folder / name;
  };
  const std::string a = counts("a", 1000);
  EXPECT_FALSE(compare(a, counts("b", 1019), {}).worse());
  EXPECT_TRUE(compare(a, counts("c", 1021), {}).worse());
  EXPECT_THROW(compare(a, folder / "none", {}), Error);
  EXPECT_THROW(compare(a, write_campaign(folder, "d", {{1.0}}, 0, ""), {}), Error);
}

}  // namespace
}  // namespace fathom::campaign::campaign_test
