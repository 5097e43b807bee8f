#include "campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "pictures.hpp"

namespace fathom::campaign {
namespace {

using Clock = std::chrono::steady_clock;

bool asked_for(const Case& what, const std::vector<std::string>& only) {
  const std::string key = key_of(what);
  return only.empty() || std::ranges::any_of(only, [&](const std::string& text) { return key.find(text) != key.npos; });
}

std::string options_of(const Settings& settings) {
  std::string text;
  for (const std::string& only : settings.only) text += " --only " + only;
  if (settings.limits.seconds < 1e9) text += fmt::format(" --limit {:g}", settings.limits.seconds);
  if (settings.limits.steps != published_steps) text += fmt::format(" --steps {}", settings.limits.steps);
  if (settings.rounds > 1) text += fmt::format(" --rounds {}", settings.rounds);
  return text.empty() ? text : text.substr(1);
}

/// The campaign so far. Figures from several builds or machines do not belong in one table: they are not comparable.
Campaign begin(const Store& store, const Settings& settings) {
  Circumstances here = circumstances_here();
  here.form = name_of(settings.form);
  here.options = options_of(settings);
  here.steps = settings.limits.steps;
  if (!store.exists()) {
    if (settings.resume)
      throw Error(ErrorCode::file, store.folder() + ": has no campaign to continue; leave --resume out to start one");
    return {here, 0, {}, {}};
  }
  if (!settings.resume)
    throw Error(ErrorCode::file,
                store.folder() + ": has a campaign already; continue it with --resume, or give another --out");
  Campaign campaign = store.load();
  const Circumstances& there = campaign.where;
  if (there.commit != here.commit || there.compiler != here.compiler || there.build_type != here.build_type)
    throw Error(ErrorCode::file, fmt::format("{}: has runs of another build ({}, {}, {}); give another --out",
                                             store.folder(), there.commit, there.compiler, there.build_type));
  if (there.processor != here.processor || there.threads != here.threads)
    throw Error(ErrorCode::file, fmt::format("{}: has runs of another machine ({}, {} threads); give another --out",
                                             store.folder(), there.processor, there.threads));
  if (there.steps != here.steps)
    throw Error(ErrorCode::file, fmt::format("{}: has runs of {} steps; give --steps {} or another --out",
                                             store.folder(), there.steps, there.steps));
  here.date = there.date;
  campaign.where = here;
  return campaign;
}

std::vector<Case> cases_of(const Settings& settings, const Offer& offer) {
  std::vector<Case> cases = plan(settings.form, offer, settings.rounds);
  std::erase_if(cases, [&](const Case& c) { return !asked_for(c, settings.only); });
  if (cases.empty())
    throw Error(
        ErrorCode::invalid_argument,
        fmt::format("no run has '{}' in its name; names are like layers-1000-native-2t-fathom", settings.only.front()));
  return cases;
}

/// Remaining time, from the expected and actual duration of runs.
class Clockwork {
 public:
  explicit Clockwork(double expected) : left_(expected) {}

  void done(double expected, double seconds) { left_ -= expected, done_ += expected, taken_ += seconds; }
  double seconds_left(double expected_of_run, double share_of_run) const {
    const double pace = done_ > 0.5 ? taken_ / done_ : 1;
    return pace * std::max(0.0, left_ - expected_of_run * share_of_run);
  }

 private:
  double left_, done_ = 0, taken_ = 0;
};

}  // namespace

bool run_campaign(const Store& store, const Settings& settings, const Observer& observe) {
  const Offer offer = offer_of_this_machine();
  const std::vector<Case> cases = cases_of(settings, offer);
  begin(store, settings);  // rejects invalid settings before a folder is created
  store.create();
  const auto claim = store.claim();
  Campaign campaign = begin(store, settings);
  const auto expected = [&](const Case& c) { return std::min(expected_seconds(c, offer), settings.limits.seconds); };
  std::vector<const Case*> open;
  double expected_total = 0;
  for (const Case& c : cases) {
    if (std::ranges::find(campaign.runs, c, &Measurement::what) != campaign.runs.end()) continue;
    open.push_back(&c);
    expected_total += expected(c);
  }
  campaign.planned = campaign.runs.size() + open.size();
  store.save(campaign);
  const std::vector<std::string>& devices = offer.devices;
  const std::string shown = devices.size() > 1 ? devices[1] : devices.front();  // a GPU rather than the host
  Painter painter(store, shown, settings.limits.steps);
  Clockwork clock(expected_total);
  for (const Case* c : open) {
    const Clock::time_point start = Clock::now();
    Progress progress{campaign.runs.size() + 1, campaign.planned, c, 0, settings.limits.steps, 0};
    std::optional<Measurement> run = run_case(*c, settings.limits, [&](std::uint64_t step, const World& world) {
      painter.visit(*c, step, world);
      progress.step = step;
      progress.seconds_left =
          clock.seconds_left(expected(*c), static_cast<double>(step) / static_cast<double>(settings.limits.steps));
      return observe(progress);
    });
    if (!run) return false;
    clock.done(expected(*c), std::chrono::duration<double>(Clock::now() - start).count());
    store.save_steps(*run);
    for (Picture& picture : painter.take()) campaign.pictures.push_back(std::move(picture));
    campaign.runs.push_back(std::move(*run));
    store.save(campaign);
  }
  return true;
}

}  // namespace fathom::campaign
