header.begin
  type = 1
header.end
spline.begin
  units.len.f = 0
  mirror.y = 1
 point.begin
 -1 2
 3 4 5
 point.end
spline.end
