// Reads a Chrome trace as strict readers do, for tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "test_folder.hpp"

namespace fathom::test {

struct TraceZone {
  int thread = 0;
  std::string name;
  std::int64_t begin = 0, end = 0;  ///< ns
  std::string parent;               ///< the innermost zone around it; empty for none
};

/// The zones of a file. Perfetto's JSON importer takes a zone's begin and length as the integer parts of 1000 times the
/// written microseconds, sorts by begin, and drops zones that partly overlap an earlier one: each is a failure here.
/// `nanoseconds` models other readers.
template <class Nanoseconds>
std::vector<TraceZone> trace_zones(const std::string& file, const Nanoseconds& nanoseconds) {
  std::vector<TraceZone> zones;
  std::map<int, std::int64_t> last;
  const nlohmann::json trace = nlohmann::json::parse(read_text(file));
  for (const nlohmann::json& e : trace.at("traceEvents")) {
    if (e.at("ph") != "X") continue;
    const std::int64_t begin = nanoseconds(e.at("ts").get<double>()), length = nanoseconds(e.at("dur").get<double>());
    EXPECT_GE(begin, last[e.at("tid")]) << "the file is sorted";
    EXPECT_GE(length, 0);
    last[e.at("tid")] = begin;
    zones.push_back({e.at("tid"), e.at("name"), begin, begin + length, {}});
  }
  std::stable_sort(zones.begin(), zones.end(), [](const TraceZone& a, const TraceZone& b) {
    return std::tuple(a.begin, -a.end) < std::tuple(b.begin, -b.end);
  });
  std::map<int, std::vector<const TraceZone*>> open;
  for (TraceZone& zone : zones) {
    std::vector<const TraceZone*>& around = open[zone.thread];
    while (!around.empty() && around.back()->end <= zone.begin) around.pop_back();
    if (!around.empty()) {
      zone.parent = around.back()->name;
      EXPECT_LE(zone.end, around.back()->end) << file << ": " << zone.name << " sticks out of " << zone.parent;
    }
    around.push_back(&zone);
  }
  return zones;
}
inline std::vector<TraceZone> trace_zones(const std::string& file) {
  return trace_zones(file, [](double microseconds) { return static_cast<std::int64_t>(microseconds * 1000.0); });
}

}  // namespace fathom::test
