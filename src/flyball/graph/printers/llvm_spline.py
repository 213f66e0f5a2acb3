"""The formula of `math/spline.py` for one number, in LLVM's language: value (order 0) or a derivative at x."""

SPLINE = """define internal double @spline(ptr %d, double %x, i64 %order) nounwind {
entry:
  %at_n = getelementptr double, ptr %d, i64 1
  %m = load double, ptr %at_n
  %count = fptosi double %m to i64
  %period = load double, ptr %d
  %breaks = getelementptr double, ptr %d, i64 2
  %begin = load double, ptr %breaks
  %periodic = fcmp ogt double %period, 0.0
  %way = fsub double %x, %begin
  %rounds = fdiv double %way, %period
  %whole = call double @llvm.floor.f64(double %rounds)
  %turns = select i1 %periodic, double %whole, double 0.0
  %shift = fmul double %period, %turns
  %y = fsub double %x, %shift
  br label %loop
loop:
  %low = phi i64 [ 0, %entry ], [ %low.next, %body ]
  %high = phi i64 [ %count, %entry ], [ %high.next, %body ]
  %more = icmp slt i64 %low, %high
  br i1 %more, label %body, label %done
body:
  %sum = add i64 %low, %high
  %middle = ashr i64 %sum, 1
  %at_b = getelementptr double, ptr %breaks, i64 %middle
  %b = load double, ptr %at_b
  %below = fcmp ole double %b, %y
  %above = add i64 %middle, 1
  %low.next = select i1 %below, i64 %above, i64 %low
  %high.next = select i1 %below, i64 %high, i64 %middle
  br label %loop
done:
  %last = sub i64 %count, 1
  %at_l = getelementptr double, ptr %breaks, i64 %last
  %l = load double, ptr %at_l
  %is_l = fcmp oeq double %y, %l
  %is_c = icmp eq i64 %low, %count
  %end = and i1 %is_l, %is_c
  %k = select i1 %end, i64 %last, i64 %low
  %k1 = sub i64 %k, 1
  %first = icmp slt i64 %k1, 0
  %k0 = select i1 %first, i64 0, i64 %k1
  %at_o = getelementptr double, ptr %breaks, i64 %k0
  %o = load double, ptr %at_o
  %origin = fadd double %o, %shift
  %s = fsub double %x, %origin
  %four = mul i64 %k, 4
  %from = add i64 %count, %four
  %c = getelementptr double, ptr %breaks, i64 %from
  %c0 = load double, ptr %c
  %at1 = getelementptr double, ptr %c, i64 1
  %c1 = load double, ptr %at1
  %at2 = getelementptr double, ptr %c, i64 2
  %c2 = load double, ptr %at2
  %at3 = getelementptr double, ptr %c, i64 3
  %c3 = load double, ptr %at3
  %sc3 = fmul double %s, %c3
  %v2 = fadd double %c2, %sc3
  %v3 = fmul double %s, %v2
  %v4 = fadd double %c1, %v3
  %v5 = fmul double %s, %v4
  %value = fadd double %c0, %v5
  %c22 = fmul double 2.0, %c2
  %sc33 = fmul double 3.0, %sc3
  %w1 = fadd double %c22, %sc33
  %w2 = fmul double %s, %w1
  %rate = fadd double %c1, %w2
  %sc36 = fmul double 6.0, %sc3
  %second = fadd double %c22, %sc36
  %third = fmul double 6.0, %c3
  %is0 = icmp eq i64 %order, 0
  %is1 = icmp eq i64 %order, 1
  %is2 = icmp eq i64 %order, 2
  %r3 = select i1 %is2, double %second, double %third
  %r2 = select i1 %is1, double %rate, double %r3
  %r1 = select i1 %is0, double %value, double %r2
  ret double %r1
}
"""
