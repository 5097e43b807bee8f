#include "plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <thread>

#include "exec/devices.hpp"
#include "scene/environments.hpp"

namespace fathom::campaign {
namespace {

constexpr int max_threads = 32;           // figures 4.1–4.9
constexpr double longest_quick_run = 20;  // s, expected

struct Sizes {
  const char* environment;
  std::vector<std::int64_t> published, huge;
};

/// Bodies. Pyramids of 5, 10 and 15 layers are published; those of 66 and 143 layers are close to the others' huge
/// sizes.
const std::vector<Sizes>& sizes() {
  static const std::vector<Sizes> all = {
      {"drift", {100, 1'000, 10'000}, {100'000, 1'000'000}},
      {"layers", {100, 1'000, 10'000}, {100'000, 1'000'000}},
      {"spread", {100, 1'000, 10'000}, {100'000, 1'000'000}},
      {"pyramid", {55, 385, 1'240}, {pyramid_bodies(30), pyramid_bodies(66), pyramid_bodies(143)}},
  };
  return all;
}

/// All runs of a scene that are worth their time in this form, on one machine.
std::vector<Case> cases_of_scene(const Case& scene, bool huge, Form form, const Offer& offer) {
  const bool quick = form == Form::quick, large = scene.bodies > 1'240;
  const int all = table_threads(offer.threads);
  std::vector<Case> cases;
  const auto add = [&](std::string_view simulator, const std::string& device, int threads, std::string_view set) {
    Case c = scene;
    c.simulator = simulator, c.device = device, c.threads = threads, c.set = set;
    if (quick && expected_seconds(c, offer) > longest_quick_run) return;
    if (std::ranges::find(cases, c) == cases.end()) cases.push_back(c);
  };
  std::vector<int> threads = thread_counts(offer.threads);
  if (quick) threads = large ? std::vector{all} : std::vector{1, all};
  if (huge) threads = {all, std::min(max_threads, offer.threads)};
  for (const SimulatorName& simulator : simulators()) {
    if (!simulator.uses_device) {
      for (const int count : threads) add(simulator.name, "", count, "fathom");
      if (!(quick && large) && !huge) add(simulator.name, "", all, "dissertation");
      continue;
    }
    for (const std::string& device : offer.devices) {
      // Large scenes on a processor show nothing new and run long.
      if (offer.is_processor(device) && (huge || (quick && large))) continue;
      for (const AlgorithmSet& set : algorithm_sets())
        if (set.name == "fathom" || !huge) add(simulator.name, device, all, set.name);
    }
  }
  return cases;
}

}  // namespace

std::string_view name_of(Form form) { return form == Form::quick ? "quick" : form == Form::full ? "full" : "huge"; }

bool Offer::is_processor(const std::string& device) const {
  return std::ranges::find(processors, device) != processors.end();
}

Offer offer_of_this_machine() {
  Offer offer{static_cast<int>(std::max(1u, std::thread::hardware_concurrency())), {}, {}};
  for (const exec::DeviceInfo& device : exec::list_devices()) {
    if (!device.available) continue;
    const std::string backend(exec::name_of(device.backend));
    offer.devices.push_back(device.backend == exec::Backend::host ? backend
                                                                  : backend + ":" + std::to_string(device.index));
    if (!device.is_gpu) offer.processors.push_back(offer.devices.back());
  }
  return offer;
}

std::vector<int> thread_counts(int hardware_threads) {
  const int most = std::min(max_threads, hardware_threads);
  std::vector<int> counts;
  for (int count = 1; count <= most; count *= 2) counts.push_back(count);
  if (counts.back() != most) counts.push_back(most);
  return counts;
}

int table_threads(int hardware_threads) { return std::min(8, hardware_threads); }

std::vector<Case> plan(Form form, const Offer& offer, int rounds) {
  std::vector<Case> all;
  for (const Sizes& environment : sizes()) {
    std::vector<std::int64_t> bodies = environment.published;
    const auto is_published = [&](std::int64_t size) {
      return std::ranges::find(environment.published, size) != environment.published.end();
    };
    if (form == Form::huge) bodies.insert(bodies.end(), environment.huge.begin(), environment.huge.end());
    for (const std::int64_t size : bodies) {
      Case scene;
      scene.environment = environment.environment, scene.bodies = size;
      const std::vector<Case> once = cases_of_scene(scene, !is_published(size), form, offer);
      for (int round = 1; round <= rounds; ++round)
        for (Case c : once) c.round = round, all.push_back(c);
    }
  }
  return all;
}

double expected_seconds(const Case& c, const Offer& offer) {
  // Microseconds per body and step with one thread of a 2023 server core, as measured; a GPU's step has a floor.
  struct Cost {
    const char* environment;
    double native, native_published, host, host_published;
  };
  constexpr std::array<Cost, 4> costs{{{"drift", 0.1, 0.8, 0.8, 1.2},
                                       {"layers", 0.7, 2.0, 2.5, 9.0},
                                       {"spread", 0.25, 1.0, 2.5, 9.0},
                                       {"pyramid", 0.7, 4.0, 5.0, 30.0}}};
  const Cost& cost = *std::ranges::find_if(costs, [&](const Cost& one) { return c.environment == one.environment; });
  const bool published = c.set == "dissertation", host = offer.is_processor(c.device);
  // The hybrid simulator resolves as the native one does.
  const bool detects_only = c.simulator == "hybrid";
  double body = host && !detects_only ? published ? cost.host_published : cost.host
                : published           ? cost.native_published
                                      : cost.native;
  double floor = 0;
  if (!c.device.empty() && !host) body *= detects_only ? 1 : 0.05, floor = 300;
  if (host && detects_only) body *= 2;
  body /= std::sqrt(static_cast<double>(c.threads));
  return 1e-6 * static_cast<double>(published_steps) * (floor + body * static_cast<double>(c.bodies)) + 0.02;
}

}  // namespace fathom::campaign
