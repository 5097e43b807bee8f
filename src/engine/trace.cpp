#include "engine/trace.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "files/output_file.hpp"

namespace fathom::engine::trace {
namespace {

struct Event {
  const char* name;
  std::int64_t begin, end;  // ns; a number over time has its value in place of the end
  bool is_count;
};

double as_double(std::int64_t bits) { return std::bit_cast<double>(bits); }

/// The zones of one thread, or of a track measured elsewhere. Outlives its thread, so that all can be written at the
/// end.
struct Track {
  std::mutex mutex;
  std::string name;
  std::vector<Event> events;
  std::size_t lost = 0;
};

struct Collection {
  std::mutex mutex;
  std::vector<std::shared_ptr<Track>> tracks;
  std::map<std::string, std::shared_ptr<Track>> named;
  std::atomic<std::size_t> limit{0};
  int sessions = 0, collecting = 0;  // there are, and still collect
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

std::shared_ptr<Track> named_track(const std::string& name) {
  {
    const std::lock_guard lock(collection().mutex);
    if (const auto found = collection().named.find(name); found != collection().named.end()) return found->second;
  }
  auto track = new_track(name);
  const std::lock_guard lock(collection().mutex);
  return collection().named.emplace(name, std::move(track)).first->second;
}

void push(Track& track, const Event& event) {
  const std::lock_guard lock(track.mutex);
  if (track.events.size() < collection().limit.load(std::memory_order_relaxed))
    track.events.push_back(event);
  else
    ++track.lost;
}

std::int64_t nanoseconds(std::chrono::steady_clock::time_point when) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(when.time_since_epoch()).count();
}

std::vector<std::shared_ptr<Track>> all_tracks() {
  const std::lock_guard lock(collection().mutex);
  return collection().tracks;
}

void append_text(fmt::memory_buffer& out, std::string_view text) {
  for (const char c : text) {
    if (c == '"' || c == '\\') out.push_back('\\');
    out.push_back(static_cast<unsigned char>(c) < 0x20 ? ' ' : c);
  }
}

/// What a session has of a track, in the order in which readers expect it: a zone comes before those within it.
std::vector<Event> events_since(const Track& track, std::int64_t begin) {
  std::vector<Event> events;
  for (const Event& event : track.events)
    if (event.begin >= begin) events.push_back(event);
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) {
    return a.begin != b.begin ? a.begin < b.begin : !a.is_count && !b.is_count && a.end > b.end;
  });
  return events;
}

/// Nanoseconds as microseconds, exactly: rounded ends would stick out of the zones around them.
std::string microseconds(std::int64_t ns) { return fmt::format("{}.{:03}", ns / 1000, ns % 1000); }

// The format: Chromium's "Trace Event Format"; ts and dur are microseconds.
void append_track(fmt::memory_buffer& out, const std::string& name, const std::vector<Event>& events, std::size_t id,
                  std::int64_t started) {
  const auto to = std::back_inserter(out);
  fmt::format_to(to, "{{\"ph\":\"M\",\"pid\":1,\"tid\":{},\"name\":\"thread_name\",\"args\":{{\"name\":\"", id);
  append_text(out, name);
  fmt::format_to(to, "\"}}}}");
  for (const Event& event : events) {
    fmt::format_to(to, ",\n{{\"ph\":\"{}\",\"pid\":1,\"tid\":{},\"ts\":{},\"name\":\"", event.is_count ? 'C' : 'X', id,
                   microseconds(event.begin - started));
    append_text(out, event.name);
    if (event.is_count)
      fmt::format_to(to, "\",\"args\":{{\"value\":{}}}}}", as_double(event.end));
    else
      fmt::format_to(to, "\",\"dur\":{}}}", microseconds(event.end - event.begin));
  }
}

}  // namespace

namespace detail {

std::atomic<bool> enabled{false};

std::int64_t now() { return nanoseconds(std::chrono::steady_clock::now()); }

void add(const char* name, std::int64_t begin, std::int64_t end) {
  // A zone that was open when collecting stopped is of no use.
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
  fmt::memory_buffer out;
  const auto flush = [&] {
    file_->write(out.data(), out.size());
    out.clear();
  };
  fmt::format_to(std::back_inserter(out), "{{\"displayTimeUnit\":\"ms\",\"traceEvents\":[\n");
  std::size_t id = 0;
  for (const auto& track : all_tracks()) {
    const std::lock_guard lock(track->mutex);
    const std::vector<Event> events = events_since(*track, begin_);
    if (events.empty()) continue;
    if (id > 0) fmt::format_to(std::back_inserter(out), ",\n");
    append_track(out, track->name, events, ++id, begin_);
    flush();
  }
  fmt::format_to(std::back_inserter(out), "\n]}}\n");
  flush();
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
  const auto stage = [&](const char* name, double milliseconds) {
    const std::int64_t end = at + static_cast<std::int64_t>(1e6 * milliseconds);
    push(track, {name, at, end, false});
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
