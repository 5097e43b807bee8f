// Messages for people: levels, the console and a rotating file (spdlog).
#pragma once

#include <fmt/format.h>

#include <memory>
#include <string>
#include <string_view>

namespace spdlog {
class logger;
}

namespace fathom::engine {

enum class LogLevel : int { trace, debug, info, warning, error, off };

/// Throws `Error{invalid_argument}` for an unknown word, suggesting the nearest.
LogLevel log_level_named(std::string_view name);

struct LogSettings {
  LogLevel level = LogLevel::info;
  bool console = true;
  std::string file{};  ///< empty: none
  int file_size = 8;   ///< MiB, after which a new file is begun
  int files = 3;       ///< number of old files kept
};

/// Thread-safe.
class Log {
 public:
  /// Throws `Error{file}` if the file cannot be written.
  explicit Log(const LogSettings& settings = {});
  ~Log();
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

  bool wants(LogLevel level) const;
  void write(LogLevel level, std::string_view text);
  template <class... Args>
  void debug(fmt::format_string<Args...> format, Args&&... args) {
    print(LogLevel::debug, format, std::forward<Args>(args)...);
  }
  template <class... Args>
  void info(fmt::format_string<Args...> format, Args&&... args) {
    print(LogLevel::info, format, std::forward<Args>(args)...);
  }
  template <class... Args>
  void warning(fmt::format_string<Args...> format, Args&&... args) {
    print(LogLevel::warning, format, std::forward<Args>(args)...);
  }
  template <class... Args>
  void error(fmt::format_string<Args...> format, Args&&... args) {
    print(LogLevel::error, format, std::forward<Args>(args)...);
  }
  void flush();

 private:
  template <class... Args>
  void print(LogLevel level, fmt::format_string<Args...> format, Args&&... args) {
    if (wants(level)) write(level, fmt::format(format, std::forward<Args>(args)...));
  }

  std::unique_ptr<spdlog::logger> logger_;
};

}  // namespace fathom::engine
