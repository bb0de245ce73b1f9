% Read a file of problems (docs/problem-files.md) in MATLAB or Octave.
%   [problems, head] = read_problems('FILE.npz')
% problems(p) has n, sizes, A (m x n), lower, upper, reference, and, where the file has answers, x,
% least, proved, posed: level k is the next sizes(k) rows of A.
function [problems, head] = read_problems(file)
  folder = tempname();
  unzip(file, folder);
  head = jsondecode(fileread(fullfile(folder, 'head.json')));
  names = {'n', 'levels', 'sizes', 'A', 'lower', 'upper', 'reference'};
  if head.answers
    names = [names, {'x', 'least', 'proved', 'posed', 'shift', 'turn'}];
  end
  for i = 1:numel(names)
    all.(names{i}) = read_npy(fullfile(folder, [names{i} '.npy']));
  end
  rmdir(folder, 's');
  at = struct('n', 0, 'L', 0, 'm', 0, 'A', 0);  % numbers that earlier problems have taken
  problems = struct([]);
  for p = 1:numel(all.n)
    n = all.n(p);
    L = all.levels(p);
    one = struct('n', n, 'sizes', all.sizes(at.L + (1:L)));
    m = sum(one.sizes);
    one.A = reshape(all.A(at.A + (1:m * n)), n, m)';
    one.lower = all.lower(at.m + (1:m));
    one.upper = all.upper(at.m + (1:m));
    one.reference = all.reference(at.n + (1:n));
    if head.answers
      one.x = all.x(at.n + (1:n));
      one.least = all.least(at.L + (1:L));
      for name = {'proved', 'posed', 'shift', 'turn'}
        one.(name{1}) = all.(name{1})(p);
      end
    end
    problems = [problems, one];
    at.n = at.n + n;
    at.L = at.L + L;
    at.m = at.m + m;
    at.A = at.A + m * n;
  end
end

function values = read_npy(file)
  stream = fopen(file, 'r', 'ieee-le');
  fread(stream, 8);  % magic, version 1.0
  header = char(fread(stream, fread(stream, 1, 'uint16'))');
  if any(strfind(header, '<i8'))
    values = double(fread(stream, Inf, 'int64'));
  else
    values = fread(stream, Inf, 'double');
  end
  fclose(stream);
end
