// smoke COUNT [SEED…]   Runs a fuzzer's function without libFuzzer, in every compiler's tests: COUNT inputs of the same
// pseudo-random bytes, or of seeds with a few bytes changed.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int main(int count, char** arguments) {
  using Bytes = std::vector<std::uint8_t>;
  std::vector<Bytes> seeds;
  for (int i = 2; i < count; ++i) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(arguments[i])) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    for (const auto& path : files) {
      std::ifstream file(path, std::ios::binary);
      seeds.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    }
  }
  std::mt19937 random(1);
  const auto below = [&](std::size_t limit) { return static_cast<std::size_t>(random()) % limit; };
  const int inputs = count > 1 ? std::atoi(arguments[1]) : 100;
  for (int i = 0; i < inputs; ++i) {
    Bytes input;
    if (!seeds.empty() && i % 4 != 0) {
      input = seeds[below(seeds.size())];
      for (std::size_t k = i < static_cast<int>(seeds.size()) ? 0 : below(6); k > 0 && !input.empty(); --k)
        input[below(input.size())] = static_cast<std::uint8_t>(random());
    } else {
      input.resize(below(600));
      for (std::uint8_t& byte : input) byte = static_cast<std::uint8_t>(random());
    }
    LLVMFuzzerTestOneInput(input.data(), input.size());
  }
  std::printf("%d inputs\n", inputs);
  return 0;
}
