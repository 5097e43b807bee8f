// Random heaps, one per seed (scene/heap.hpp), and what every one must fulfil (heap_checks.hpp).
#include <cstdio>
#include <map>

#include "validate/case_list.hpp"
#include "validate/heap_checks.hpp"

namespace fathom::validate {
namespace {

std::string to_line(const Check& check) {
  char text[200];
  std::snprintf(text, sizeof text, "%s: %.4g (at most %.4g)%s%s", check.name.c_str(), check.value, check.limit,
                check.unit.empty() ? "" : " ", check.unit.c_str());
  return text;
}

/// An error thrown by the engine fails that seed alone.
Record judged(const Heap& heap, const Setup& setup) {
  try {
    return judge_heap(heap, setup);
  } catch (const Error& error) {
    Record record;
    record.at_most("ended with an error", 1, 0);
    record.note(error.what());
    return record;
  }
}

void judge_heaps(Heap (*make)(std::uint64_t seed), int brief_seeds, const Setup& setup, Record& record) {
  const int seeds = setup.heap_seeds > 0 ? setup.heap_seeds : setup.full ? 60 : brief_seeds;
  std::map<std::string, int> judged_by, failed;
  std::map<std::string, std::string> known;
  for (int i = 0; i < seeds; ++i) {
    const std::uint64_t seed = setup.first_heap + static_cast<std::uint64_t>(i);
    const Heap heap = make(seed);
    const Record found = judged(heap, setup);
    std::string failures;
    for (const Check& check : found.checks) {
      ++judged_by[check.name];
      known[check.name] = check.known;
      if (check.passed()) continue;
      ++failed[check.name];
      failures += (failures.empty() ? "" : "; ") + to_line(check);
    }
    if (failures.empty()) continue;
    std::string line = "seed " + std::to_string(seed) + ": " + failures + "\n  ";
    for (const std::string& note : found.notes) line += note;
    line += "\n  " + view_command(heap.scene.name, seed, setup);
    record.note(line);
    if (setup.say) setup.say(line);
  }
  for (const auto& [name, count] : judged_by)
    record.at_most(name + ": heaps of " + std::to_string(count), failed[name], 0).known = known[name];
}

}  // namespace

void heaps(const Setup& setup, Record& record) { judge_heaps(make_heap, 6, setup, record); }

void heaps_on_surfaces(const Setup& setup, Record& record) { judge_heaps(make_surface_heap, 2, setup, record); }

void heaps_with_joints(const Setup& setup, Record& record) { judge_heaps(make_joint_heap, 4, setup, record); }

}  // namespace fathom::validate
