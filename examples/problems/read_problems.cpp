// Read a file of problems (docs/problem-files.md) with the standard library alone.
//   g++ -std=c++17 -O2 read_problems.cpp -o read_problems && ./read_problems FILE.npz
// An .npz without compression: for each member a zip header, then an .npy header, then the numbers.
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

using Members = std::map<std::string, std::string>;  // name -> bytes

template <class T> T number(const std::string& bytes, size_t at) {
  T value;
  if (at + sizeof(T) > bytes.size()) throw std::runtime_error("ends too early");
  std::memcpy(&value, bytes.data() + at, sizeof(T));  // both are little-endian
  return value;
}

Members members(const char* path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot be opened");
  const std::string zip{std::istreambuf_iterator<char>(file), {}};
  Members found;
  for (size_t at = 0; at + 30 < zip.size() && number<uint32_t>(zip, at) == 0x04034b50;) {
    const size_t size = number<uint32_t>(zip, at + 18), name = number<uint16_t>(zip, at + 26);
    const size_t begin = at + 30 + name + number<uint16_t>(zip, at + 28);
    if (number<uint16_t>(zip, at + 8)) throw std::runtime_error("has a compressed member");
    found[zip.substr(at + 30, name)] = zip.substr(begin, size);
    at = begin + size;
  }
  return found;
}

// The numbers of an array; T is double or int64_t, as docs/problem-files.md says.
template <class T> std::vector<T> array(const Members& all, const std::string& name) {
  const auto found = all.find(name + ".npy");
  if (found == all.end()) throw std::runtime_error("has no array " + name);
  const std::string& npy = found->second;
  const size_t begin = 10 + number<uint16_t>(npy, 8);  // version 1.0 of the format of numpy
  std::vector<T> values((npy.size() - begin) / sizeof(T));
  std::memcpy(values.data(), npy.data() + begin, values.size() * sizeof(T));
  return values;
}

void print(const char* path) {
  const Members all = members(path);
  const auto n = array<int64_t>(all, "n"), levels = array<int64_t>(all, "levels");
  const auto sizes = array<int64_t>(all, "sizes");
  const auto A = array<double>(all, "A");  // lower, upper, reference, x, ... likewise
  size_t level = 0, row = 0, entry = 0;  // where the problem, the level, the row begins
  for (size_t p = 0; p < n.size(); ++p) {
    double sum = 0.0;
    size_t m = 0;
    for (int64_t k = 0; k < levels[p]; ++k) m += sizes[level++];
    for (size_t i = 0; i < m * n[p]; ++i) sum += A[entry + i];  // A[entry + n[p] * row + column]
    std::printf("%zu: n %d, rows %zu, sum of A %.17g\n", p, int(n[p]), m, sum);
    entry += m * n[p], row += m;
  }
}

int main(int argc, char** argv) try {
  if (argc != 2) throw std::runtime_error("give one FILE.npz");
  print(argv[1]);
} catch (const std::exception& error) {
  std::fprintf(stderr, "read_problems%s%s: %s\n", argc == 2 ? ": " : "", argc == 2 ? argv[1] : "",
               error.what());
  return 2;
}
