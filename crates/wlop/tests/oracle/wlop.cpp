// Consolidates points with CGAL and tells what that cost, as an oracle for this crate.
//
// wlop IN OUT PERCENT RADIUS ITERATIONS: IN and OUT are files of little-endian f64 triples. Prints the
// CPU seconds of the call alone. Build: c++ -O3 -DNDEBUG wlop.cpp -o wlop
#include <CGAL/Simple_cartesian.h>
#include <CGAL/wlop_simplify_and_regularize_point_set.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <iterator>
#include <vector>

typedef CGAL::Simple_cartesian<double> Kernel;
typedef Kernel::Point_3 Point;

static std::vector<Point> read(const char* path) {
  std::vector<Point> points;
  std::FILE* file = std::fopen(path, "rb");
  if (!file) { std::perror(path); std::exit(2); }
  double p[3];
  while (std::fread(p, sizeof p, 1, file) == 1) points.push_back(Point(p[0], p[1], p[2]));
  std::fclose(file);
  return points;
}

static void write(const char* path, const std::vector<Point>& points) {
  std::FILE* file = std::fopen(path, "wb");
  if (!file) { std::perror(path); std::exit(2); }
  for (const Point& at : points) {
    const double p[3] = {at.x(), at.y(), at.z()};
    if (std::fwrite(p, sizeof p, 1, file) != 1) { std::perror(path); std::exit(2); }
  }
  if (std::fclose(file) != 0) { std::perror(path); std::exit(2); }
}

int main(int argc, char** argv) {
  if (argc != 6) {
    std::fprintf(stderr, "usage: %s IN OUT PERCENT RADIUS ITERATIONS\n", argv[0]);
    return 2;
  }
  std::vector<Point> points = read(argv[1]), kept;
  const std::clock_t start = std::clock();
  CGAL::wlop_simplify_and_regularize_point_set<CGAL::Sequential_tag>(
      points, std::back_inserter(kept),
      CGAL::parameters::select_percentage(std::atof(argv[3]))
          .neighbor_radius(std::atof(argv[4]))
          .number_of_iterations(std::atoi(argv[5]))
          .require_uniform_sampling(true));
  std::printf("%.3f\n", double(std::clock() - start) / CLOCKS_PER_SEC);
  write(argv[2], kept);
  return 0;
}
