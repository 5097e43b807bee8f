// Runs the program from outside, for tests, with its output in files of a folder.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "test_folder.hpp"

namespace fathom::test {

using Words = std::vector<std::string>;

inline Words operator+(Words a, const Words& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

struct Outcome {
  int exit_code = -1;
  std::string out;
  std::string err;
};

class Program : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_ / name; }

  /// Starts the program with its output in files of the folder.
  pid_t start(const std::vector<std::string>& arguments) const {
    const pid_t child = fork();
    if (child != 0) return child;
    // nohup and shells' background jobs ignore some, which programs inherit and keep ignoring.
    for (const int number : {SIGHUP, SIGINT, SIGQUIT, SIGPIPE}) std::signal(number, SIG_DFL);
    const rlimit limit{largest_file_, largest_file_};
    setrlimit(RLIMIT_FSIZE, &limit);
    redirect(STDOUT_FILENO, path(stdout_));
    redirect(STDERR_FILENO, path(stderr_));
    for (const int number : closed_) close(number);
    std::string program = FATHOM_PROGRAM;
    std::vector<std::string> words = arguments;
    std::vector<char*> argv{program.data()};
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    execv(program.c_str(), argv.data());
    _exit(127);
  }

  Outcome finish(pid_t child) const {
    int status = 0;
    waitpid(child, &status, 0);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(path("out")), read_text(path("err"))};
  }

  Outcome fathom(const std::vector<std::string>& arguments) const { return finish(start(arguments)); }

  /// The names of all files of the folder.
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }

  /// The name under which the process writes a file.
  std::string growing(const std::string& name, pid_t process) const {
    return path(name) + ".partial-" + std::to_string(process);
  }
  /// Waits until the process has written this many bytes of it.
  bool has_grown(const std::string& name, pid_t process, std::size_t bytes = 1) const {
    std::error_code none;
    for (int i = 0; i < 1000; ++i) {
      const auto size = std::filesystem::file_size(growing(name, process), none);
      if (!none && size >= bytes) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }

  /// The result of `fathom run` with these arguments; it must succeed.
  nlohmann::json result_of(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "run");
    arguments.insert(arguments.end(), {"--json", "-", "--quiet"});
    const Outcome outcome = fathom(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  }

 private:
  static void redirect(int descriptor, const std::string& file) {
    const int opened = open(file.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
    dup2(opened, descriptor);
    close(opened);
  }

  TestFolder folder_;

 protected:
  std::string stdout_ = "out", stderr_ = "err";
  std::vector<int> closed_;              ///< descriptors that are closed for the program
  rlim_t largest_file_ = RLIM_INFINITY;  ///< bytes; beyond them writing fails as on a full disk
};

}  // namespace fathom::test
