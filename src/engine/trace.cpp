#include "engine/trace.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "files/output_file.hpp"

namespace fathom::engine::trace {
namespace {

struct Event {
  const char* name;
  std::int64_t begin, end;  // ns; a counter stores its value in place of the end
  bool is_count;
};

double as_double(std::int64_t bits) { return std::bit_cast<double>(bits); }

/// The zones of one thread, or of a track measured elsewhere. Outlives its thread: all zones are written at the end.
struct Track {
  std::mutex mutex;
  std::string name;
  std::vector<Event> events;
  std::size_t lost = 0;
};

struct Collection {
  std::mutex mutex;
  std::vector<std::shared_ptr<Track>> tracks;
  std::map<std::pair<const Track*, std::string>, std::shared_ptr<Track>> named;
  std::atomic<std::size_t> limit{0};
  int sessions = 0, collecting = 0;  // existing, and still collecting
};

Collection& collection() {
  static Collection one;
  return one;
}

std::shared_ptr<Track> new_track(std::string name) {
  Collection& all = collection();
  auto track = std::make_shared<Track>();
  const std::lock_guard lock(all.mutex);
  track->name = name.empty() ? "thread " + std::to_string(all.tracks.size() + 1) : std::move(name);
  all.tracks.push_back(track);
  return track;
}

Track& own_track() {
  thread_local const std::shared_ptr<Track> track = new_track({});
  return *track;
}

/// Tracks are per thread and name: zones of two engines on one device would not nest on one line.
std::shared_ptr<Track> named_track(const std::string& name) {
  const std::pair<const Track*, std::string> key(&own_track(), name);
  {
    const std::lock_guard lock(collection().mutex);
    if (const auto found = collection().named.find(key); found != collection().named.end()) return found->second;
  }
  auto track = new_track(name);
  const std::lock_guard lock(collection().mutex);
  return collection().named.emplace(key, std::move(track)).first->second;
}

void push(Track& track, const Event& event) {
  const std::lock_guard lock(track.mutex);
  if (track.events.size() < collection().limit.load(std::memory_order_relaxed))
    track.events.push_back(event);
  else
    ++track.lost;
}

std::int64_t last_end(Track& track) {
  const std::lock_guard lock(track.mutex);
  return track.events.empty() ? 0 : track.events.back().end;
}

std::int64_t nanoseconds(std::chrono::steady_clock::time_point when) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(when.time_since_epoch()).count();
}

std::vector<std::shared_ptr<Track>> all_tracks() {
  const std::lock_guard lock(collection().mutex);
  return collection().tracks;
}

/// A session's events of a track, in the order that readers expect: outer zones before inner ones.
std::vector<Event> events_since(const Track& track, std::int64_t begin) {
  std::vector<Event> events;
  for (const Event& event : track.events)
    if (event.begin >= begin) events.push_back(event);
  const auto order = [](const Event& e) { return std::tuple(e.begin, e.is_count, e.is_count ? 0 : -e.end); };
  std::stable_sort(events.begin(), events.end(), [&](const Event& a, const Event& b) { return order(a) < order(b); });
  return events;
}

using Text = fmt::memory_buffer;

void append(Text& out, std::string_view text) { out.append(text.data(), text.data() + text.size()); }

void append_name(Text& out, std::string_view name) {
  for (const char c : name) {
    if (c == '"' || c == '\\') out.push_back('\\');
    out.push_back(static_cast<unsigned char>(c) < 0x20 ? ' ' : c);
  }
}

/// Nanoseconds as microseconds, to the nanosecond: rounded ends would extend beyond enclosing zones. Perfetto takes the
/// integer part of 1000 times the number, and for 1000 * 0.871 that is 870, so a tenth of a nanosecond is added.
void append_microseconds(Text& out, std::int64_t ns) {
  const fmt::format_int whole(ns / 1000);
  append(out, {whole.data(), whole.size()});
  const auto digit = [ns](int of) { return static_cast<char>('0' + ns / of % 10); };
  const char decimals[] = {'.', digit(100), digit(10), digit(1), '1'};
  append(out, {decimals, sizeof decimals});
}

// Chromium's "Trace Event Format"; ts and dur are microseconds. Formatted by hand, because a long run has a million
// zones and must end within a second.
void write_track(files::OutputFile& file, const std::string& name, const std::vector<Event>& events, std::size_t id,
                 std::int64_t started) {
  Text out;
  const std::string thread = fmt::format("\",\"pid\":1,\"tid\":{},", id);
  append(out, "{\"ph\":\"M");
  append(out, thread);
  append(out, "\"name\":\"thread_name\",\"args\":{\"name\":\"");
  append_name(out, name);
  append(out, "\"}}");
  for (const Event& event : events) {
    append(out, event.is_count ? ",\n{\"ph\":\"C" : ",\n{\"ph\":\"X");
    append(out, thread);
    append(out, "\"ts\":");
    append_microseconds(out, event.begin - started);
    append(out, ",\"name\":\"");
    append_name(out, event.name);
    if (event.is_count) {
      fmt::format_to(std::back_inserter(out), "\",\"args\":{{\"value\":{}}}}}", as_double(event.end));
    } else {
      append(out, "\",\"dur\":");
      append_microseconds(out, event.end - event.begin);
      out.push_back('}');
    }
    if (out.size() < 1 << 16) continue;
    file.write(out.data(), out.size());
    out.clear();
  }
  file.write(out.data(), out.size());
}

}  // namespace

namespace detail {

std::atomic<bool> enabled{false};

std::int64_t now() { return nanoseconds(std::chrono::steady_clock::now()); }

void add(const char* name, std::int64_t begin, std::int64_t end) {
  // A zone still open when collecting stopped is useless.
  if (enabled.load(std::memory_order_relaxed)) push(own_track(), {name, begin, end, false});
}

}  // namespace detail

Session::Session(const std::string& path, std::size_t limit)
    : file_(path.empty() ? nullptr : std::make_unique<files::OutputFile>(path)) {
  Collection& all = collection();
  const std::lock_guard lock(all.mutex);
  if (all.sessions == 0) {
    all.limit = 0;
    all.named.clear();
    std::erase_if(all.tracks, [](const auto& track) { return track.use_count() == 1; });  // their threads have ended
    for (const auto& track : all.tracks) {
      const std::lock_guard of_track(track->mutex);
      track->events.clear();
      track->lost = 0;
    }
  }
  all.limit = std::max(all.limit.load(), limit);
  begin_ = detail::now();
  ++all.sessions, ++all.collecting;
  detail::enabled = true;
}

Session::~Session() {
  stop();
  const std::lock_guard lock(collection().mutex);
  --collection().sessions;
}

void Session::stop() {
  if (!std::exchange(collects_, false)) return;
  const std::lock_guard lock(collection().mutex);
  if (--collection().collecting == 0) detail::enabled = false;
}

void Session::finish() {
  stop();
  if (!file_) return;
  file_->write("{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n");
  std::size_t id = 0;
  for (const auto& track : all_tracks()) {
    const std::lock_guard lock(track->mutex);
    const std::vector<Event> events = events_since(*track, begin_);
    if (events.empty()) continue;
    if (id > 0) file_->write(",\n");
    write_track(*file_, track->name, events, ++id, begin_);
  }
  file_->write("\n]}\n");
  file_->finish();
  file_.reset();
}

std::size_t Session::zone_count() const {
  std::size_t sum = 0;
  for (const auto& track : all_tracks()) {
    const std::lock_guard lock(track->mutex);
    sum += events_since(*track, begin_).size();
  }
  return sum;
}

std::size_t Session::lost_count() const {
  std::size_t sum = 0;
  for (const auto& track : all_tracks()) {
    const std::lock_guard lock(track->mutex);
    sum += track->lost;
  }
  return sum;
}

void name_thread(const std::string& name) {
  Track& track = own_track();
  const std::lock_guard lock(track.mutex);
  track.name = name;
}

void add_zone(const char* name, std::chrono::steady_clock::time_point begin, double milliseconds) {
  const std::int64_t start = nanoseconds(begin);
  detail::add(name, start, start + static_cast<std::int64_t>(1e6 * milliseconds));
}

void add_on_track(const std::string& track, const char* zone, std::chrono::steady_clock::time_point begin,
                  double milliseconds) {
  if (!enabled()) return;
  const std::int64_t start = nanoseconds(begin);
  push(*named_track(track), {zone, start, start + static_cast<std::int64_t>(1e6 * milliseconds), false});
}

void add_step(const StageTimes& times, std::chrono::steady_clock::time_point begin, const std::string& device) {
  if (!enabled()) return;
  const std::shared_ptr<Track> named = device.empty() ? nullptr : named_track(device);
  Track& track = named ? *named : own_track();
  std::int64_t at = nanoseconds(begin);
  // A device's clock may run ahead of the host's until its next step.
  if (named) at = std::max(at, last_end(track));
  const auto stage = [&](const char* name, double milliseconds) {
    const std::int64_t end = at + static_cast<std::int64_t>(1e6 * milliseconds);
    // A nanosecond shorter: it and the next must never overlap, however a reader adds the written numbers.
    push(track, {name, at, std::max(at, end - 1), false});
    at = end;
  };
  stage("find_pairs", times.find_pairs);
  stage("update_manifolds", times.update_manifolds);
  stage("build_constraints", times.build_constraints);
  stage("solve", times.solve);
  stage("finish", times.finish);
}

void count(const char* name, double value) {
  if (enabled()) push(own_track(), {name, detail::now(), std::bit_cast<std::int64_t>(value), true});
}

}  // namespace fathom::engine::trace
